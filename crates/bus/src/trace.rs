//! What travels beside a message: sequence, source time and the W3C trace context.

use std::collections::HashMap;

use kittiwake_proto::v1::Attachment;
use opentelemetry::Context;
use opentelemetry::propagation::TextMapPropagator;
use opentelemetry::trace::TraceContextExt;
use opentelemetry_sdk::propagation::TraceContextPropagator;
use prost::Message;
use tracing::Span;
use tracing_opentelemetry::OpenTelemetrySpanExt;

/// The trace that caused an event, in `traceparent` form.
pub(crate) type Parent = String;

/// A larger attachment is none of ours.
const MAX_ATTACHMENT: usize = 256;

/// The attachment in `bytes`; a malformed one counts as none, since the payload stands for itself.
pub(crate) fn read(bytes: &[u8]) -> Option<Attachment> {
    (bytes.len() <= MAX_ATTACHMENT).then(|| Attachment::decode(bytes).ok()).flatten()
}

/// A span for handling something that `parent` caused.
pub(crate) fn span(what: &'static str, parent: Option<&Parent>) -> Span {
    let span = tracing::info_span!("handle", otel.name = what);
    if let Some(parent) = parent {
        let carrier = HashMap::from([("traceparent".to_owned(), parent.clone())]);
        // Fails only where no tracer is installed, and then there is no trace to continue.
        let _ = span.set_parent(TraceContextPropagator::new().extract(&carrier));
    }
    span
}

/// The present span as a parent for others; `None` where there is no trace.
pub(crate) fn current() -> Option<Parent> {
    let context: Context = Span::current().context();
    if !context.span().span_context().is_valid() {
        return None;
    }
    let mut carrier = HashMap::new();
    TraceContextPropagator::new().inject_context(&context, &mut carrier);
    carrier.remove("traceparent")
}

/// The trace's own id in `traceparent`; empty if there is none.
pub(crate) fn id(traceparent: &str) -> String {
    traceparent.split('-').nth(1).unwrap_or_default().to_owned()
}
