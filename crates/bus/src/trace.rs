//! What travels beside a message: sequence, source time and the W3C trace context.

use kittiwake_proto::v1::Attachment;
use opentelemetry::Context;
use opentelemetry::trace::{SpanContext, SpanId, TraceContextExt, TraceFlags, TraceId, TraceState};
use prost::Message;
use tracing::Span;
use tracing_opentelemetry::OpenTelemetrySpanExt;

/// The trace that caused an event, in `traceparent` form.
pub(crate) type Parent = String;

/// Our attachments are never larger.
const MAX_ATTACHMENT: usize = 512;

/// The attachment in `bytes`; a malformed one counts as none, since the payload stands for itself.
pub(crate) fn read(bytes: &[u8]) -> Option<Attachment> {
    (bytes.len() <= MAX_ATTACHMENT).then(|| Attachment::decode(bytes).ok()).flatten()
}

/// A span for handling something that `parent` caused.
pub(crate) fn span(what: &'static str, parent: Option<&Parent>) -> Span {
    let span = tracing::info_span!("handle", otel.name = what);
    if let Some(parent) = parent.and_then(|it| parse(it)) {
        // Fails only where no tracer is installed, and then there is no trace to continue.
        let _ = span.set_parent(Context::new().with_remote_span_context(parent));
    }
    span
}

/// The present span as a parent for others; `None` where there is no trace.
pub(crate) fn current() -> Option<Parent> {
    let context: Context = Span::current().context();
    let span = context.span();
    let it = span.span_context();
    it.is_valid().then(|| format!("00-{}-{}-{:02x}", it.trace_id(), it.span_id(), it.trace_flags().to_u8()))
}

/// A `traceparent` of the W3C's trace context, version 00. The library's propagator does the same by way of a map
/// made for each message, which shows in the way of a flag.
fn parse(traceparent: &str) -> Option<SpanContext> {
    let mut parts = traceparent.split('-');
    let (version, trace, span, flags) = (parts.next()?, parts.next()?, parts.next()?, parts.next()?);
    if version != "00" || trace.len() != 32 || span.len() != 16 || flags.len() != 2 || parts.next().is_some() {
        return None;
    }
    let flags = TraceFlags::new(u8::from_str_radix(flags, 16).ok()?);
    let (trace, span) = (TraceId::from_hex(trace).ok()?, SpanId::from_hex(span).ok()?);
    Some(SpanContext::new(trace, span, flags, true, TraceState::NONE)).filter(SpanContext::is_valid)
}

/// The trace's own id in `traceparent`; empty if there is none.
pub(crate) fn id(traceparent: &str) -> String {
    traceparent.split('-').nth(1).unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_traceparent_is_read_as_the_w3c_writes_it() {
        let context = parse("00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01").unwrap();
        assert_eq!(context.trace_id().to_string(), "4bf92f3577b34da6a3ce929d0e0e4736");
        assert_eq!(context.span_id().to_string(), "00f067aa0ba902b7");
        assert!(context.is_sampled() && context.is_remote());
        for malformed in [
            "",
            "00",
            "01-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e473-00f067aa0ba902b7-01",
            "00-zzf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
            "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-more",
        ] {
            assert!(parse(malformed).is_none(), "{malformed}");
        }
    }
}
