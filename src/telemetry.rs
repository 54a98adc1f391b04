//! Logs to standard error and traces to a collector.
//!
//! Spans are always made, so that trace ids travel with every message from the first on. They are
//! exported only where an endpoint is named: the configuration's, or `OTEL_EXPORTER_OTLP_ENDPOINT`.
//! Export has a thread and a bounded queue of its own; a collector that hangs costs spans, never time.

use std::time::Duration;

use opentelemetry::KeyValue;
use opentelemetry::trace::TracerProvider;
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{BatchSpanProcessor, Sampler, SdkTracerProvider};
use serde::Deserialize;
use tracing_subscriber::filter::{EnvFilter, LevelFilter, Targets};
use tracing_subscriber::prelude::*;

use crate::output::LogRecord;

#[cfg(feature = "otlp")]
mod export;
mod sampling;

/// Where traces go.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Base URL of an OTLP collector that takes HTTP, such as `http://127.0.0.1:4318`; absent: the
    /// environment variable's, or none.
    pub otlp_endpoint: Option<String>,
}

/// Names the collector, before the configuration.
const VARIABLE: &str = "OTEL_EXPORTER_OTLP_ENDPOINT";
/// What is left is exported at the end of the process within this, or lost.
const END_LIMIT: Duration = Duration::from_secs(1);

/// The process's tracer.
pub struct Telemetry(SdkTracerProvider);

/// Starts logging and tracing for the process of `service`.
pub fn start(service: &'static str, vehicle: &str, config: &Config) -> Telemetry {
    let export = endpoint(config).map(|it| export(&it)).transpose();
    let problem = export.as_ref().err().cloned();
    let provider = provider(service, vehicle, export.ok().flatten());
    // The exporter's own log would only repeat that the collector does not answer.
    let default = EnvFilter::new("warn,opentelemetry=off,opentelemetry_sdk=off,opentelemetry_otlp=off,zenoh=error");
    let level = EnvFilter::try_from_default_env().unwrap_or(default);
    let log =
        tracing_subscriber::fmt::layer().with_writer(LogRecord::default).with_ansi(false).log_internal_errors(false);
    // Only our own spans: a transport that traced its own export would export its traces.
    let ours = Targets::new().with_target("bus", LevelFilter::INFO).with_target("kittiwake", LevelFilter::INFO);
    let traces = tracing_opentelemetry::layer().with_tracer(provider.tracer("kittiwake")).with_filter(ours);
    tracing_subscriber::registry().with(log.with_filter(level)).with(traces).init();
    if let Some(cause) = problem {
        tracing::warn!(cause, "traces are not exported");
    }
    Telemetry(provider)
}

impl Telemetry {
    /// Exports what is left, if that goes quickly.
    pub fn end(self) {
        // Late or failed: the spans are lost, and nothing else.
        let _ = self.0.shutdown_with_timeout(END_LIMIT);
    }
}

fn provider(service: &'static str, vehicle: &str, export: Option<BatchSpanProcessor>) -> SdkTracerProvider {
    let attributes = [KeyValue::new("service.name", service), KeyValue::new("kittiwake.vehicle", vehicle.to_owned())];
    let provider = SdkTracerProvider::builder().with_resource(Resource::builder().with_attributes(attributes).build());
    let Some(export) = export else {
        // Ids are passed on; spans are not recorded if they are not exported.
        return provider.with_sampler(Sampler::AlwaysOff).build();
    };
    provider.with_sampler(sampling::ByCause).with_span_processor(export).build()
}

/// The collector's base URL; `None` where none is named.
fn endpoint(config: &Config) -> Option<String> {
    let named_by_environment = std::env::var(VARIABLE).ok().filter(|it| !it.is_empty());
    named_by_environment.or_else(|| config.otlp_endpoint.clone())
}

/// Exports to the collector at `endpoint`.
#[cfg(feature = "otlp")]
fn export(endpoint: &str) -> Result<BatchSpanProcessor, String> {
    export::to(endpoint)
}

/// The libraries of the exporter are not in this build.
#[cfg(not(feature = "otlp"))]
fn export(endpoint: &str) -> Result<BatchSpanProcessor, String> {
    Err(format!("this build has no exporter for {endpoint}: build it with `--features otlp`"))
}
