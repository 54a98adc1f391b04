//! Which traces are exported.
//!
//! What follows from an operator's request is exported always. Most of what happens on the bus follows from nothing but time: of such
//! traces one in a hundred is exported, chosen by its id, so that every process of the system chooses the same ones.

use opentelemetry::trace::{Link, SpanKind, TraceContextExt, TraceId};
use opentelemetry::{Context, KeyValue};
use opentelemetry_sdk::trace::{Sampler, SamplingResult, ShouldSample};

/// The share of traces that follow from nothing. (ENG: a system sends some hundred spans a second of them, and one a second is seen.)
const SHARE: f64 = 0.01;

/// Chooses by what a span follows from.
#[derive(Debug, Clone)]
pub(super) struct ByCause;

impl ShouldSample for ByCause {
    fn should_sample(
        &self,
        parent_context: Option<&Context>,
        trace_id: TraceId,
        name: &str,
        span_kind: &SpanKind,
        attributes: &[KeyValue],
        links: &[Link],
    ) -> SamplingResult {
        let parent = parent_context.map(|it| it.span().span_context().clone()).filter(|it| it.is_valid());
        let sampler = match parent {
            Some(parent) if parent.is_sampled() => Sampler::AlwaysOn,
            // The process that asked has chosen, and this one would choose the same but where that one exports nothing.
            Some(_) => Sampler::TraceIdRatioBased(SHARE),
            None if *span_kind == SpanKind::Server => Sampler::AlwaysOn,
            None => Sampler::TraceIdRatioBased(SHARE),
        };
        sampler.should_sample(parent_context, trace_id, name, span_kind, attributes, links)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use opentelemetry::trace::{SpanContext, SpanId, TraceFlags, TraceState};
    use opentelemetry_sdk::trace::SamplingDecision;

    /// How many of a thousand traces are exported, with a parent that was sampled, was not, or is not there.
    fn exported(kind: &SpanKind, sampled: Option<bool>) -> usize {
        let of_trace = |n: u128| {
            // Spread over all ids, as random ones are.
            let trace = TraceId::from(n.wrapping_mul(0x9e37_79b9_7f4a_7c15_9e37_79b9_7f4a_7c15));
            let parent = sampled.map(|sampled| {
                let flags = if sampled { TraceFlags::SAMPLED } else { TraceFlags::default() };
                let parent = SpanContext::new(trace, SpanId::from(7), flags, true, TraceState::NONE);
                Context::new().with_remote_span_context(parent)
            });
            ByCause.should_sample(parent.as_ref(), trace, "handle", kind, &[], &[]).decision
        };
        (1..=1000).filter(|n| of_trace(*n) == SamplingDecision::RecordAndSample).count()
    }

    #[test]
    fn what_a_request_causes_is_exported_and_little_of_what_nothing_causes() {
        assert_eq!(exported(&SpanKind::Server, None), 1000);
        assert_eq!(exported(&SpanKind::Internal, Some(true)), 1000);
        let few = exported(&SpanKind::Internal, None);
        assert!((1..50).contains(&few), "{few}");
        assert_eq!(exported(&SpanKind::Internal, Some(false)), few, "every process chooses the same");
    }
}
