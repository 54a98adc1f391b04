//! The trace that an order belongs to: that of its `traceparent` header, or one that begins here. A span covers
//! the request from its head to its answer.

use std::collections::HashMap;

use axum::http::HeaderMap;
use opentelemetry::propagation::TextMapPropagator;
use opentelemetry::trace::TraceContextExt;
use opentelemetry_sdk::propagation::TraceContextPropagator;
use tracing::Span;
use tracing_opentelemetry::OpenTelemetrySpanExt;

const HEADER: &str = "traceparent";

/// A span for an order of `method` on `route`.
pub(crate) fn span(method: &str, route: &str, headers: &HeaderMap) -> Span {
    let name = format!("{method} {route}");
    let span = tracing::info_span!(
        target: "kittiwake::http",
        "request",
        otel.name = name,
        otel.kind = "server",
        http.request.method = method,
        http.route = route,
        http.response.status_code = tracing::field::Empty,
    );
    let given = headers.get(HEADER).and_then(|it| it.to_str().ok());
    if let Some(given) = given {
        let carrier = HashMap::from([(HEADER.to_owned(), given.to_owned())]);
        // Fails only where no tracer is installed: there is no trace to continue then.
        let _ = span.set_parent(TraceContextPropagator::new().extract(&carrier));
    }
    span
}

/// The `traceparent` of what follows from the request; `None` where nothing is traced.
pub(crate) fn traceparent(span: &Span) -> Option<String> {
    let context = span.context();
    if !context.span().span_context().is_valid() {
        return None;
    }
    let mut carrier = HashMap::new();
    TraceContextPropagator::new().inject_context(&context, &mut carrier);
    carrier.remove(HEADER)
}

/// Adds the status of the answer to the span.
pub(crate) fn answered(span: &Span, status: u16) {
    span.record("http.response.status_code", status);
}
