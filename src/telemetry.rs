//! Logs to standard error and traces to a collector.
//!
//! Spans are always made, so that trace ids travel with every message from the first on. They are
//! exported only where an endpoint is named: the configuration's, or `OTEL_EXPORTER_OTLP_ENDPOINT`.
//! Export has a thread and a bounded queue of its own; a collector that hangs costs spans, never time.

use std::time::Duration;

use opentelemetry::KeyValue;
use opentelemetry::trace::TracerProvider;
use opentelemetry_otlp::{Protocol, SpanExporter, WithExportConfig, WithHttpConfig};
use opentelemetry_sdk::Resource;
use opentelemetry_sdk::trace::{BatchConfigBuilder, BatchSpanProcessor, Sampler, SdkTracerProvider};
use serde::Deserialize;
use tracing_subscriber::filter::{EnvFilter, LevelFilter, Targets};
use tracing_subscriber::prelude::*;

use crate::http_client::client;
use crate::output::LogRecord;

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
/// Spans that wait for export; more are dropped.
const QUEUE: usize = 2048;
/// A collector that takes longer for a batch loses it.
const EXPORT_LIMIT: Duration = Duration::from_secs(2);
/// What is left is exported at the end of the process within this, or lost.
const END_LIMIT: Duration = Duration::from_secs(1);

/// The process's tracer.
pub struct Telemetry(SdkTracerProvider);

/// Starts logging and tracing for the process of `service`.
pub fn start(service: &'static str, vehicle: &str, config: &Config) -> Telemetry {
    let exporter = exporter(config);
    let problem = exporter.as_ref().err().cloned();
    let provider = provider(service, vehicle, exporter.ok().flatten());
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

fn provider(service: &'static str, vehicle: &str, exporter: Option<SpanExporter>) -> SdkTracerProvider {
    let attributes = [KeyValue::new("service.name", service), KeyValue::new("kittiwake.vehicle", vehicle.to_owned())];
    let provider = SdkTracerProvider::builder().with_resource(Resource::builder().with_attributes(attributes).build());
    let Some(exporter) = exporter else {
        // Ids are passed on; spans are not recorded if they are not exported.
        return provider.with_sampler(Sampler::AlwaysOff).build();
    };
    let provider = provider.with_sampler(sampling::ByCause);
    let batches = BatchConfigBuilder::default().with_max_queue_size(QUEUE).build();
    provider.with_span_processor(BatchSpanProcessor::builder(exporter).with_batch_config(batches).build()).build()
}

/// To the named collector; `None` where none is named.
fn exporter(config: &Config) -> Result<Option<SpanExporter>, String> {
    let named_by_environment = std::env::var(VARIABLE).ok().filter(|it| !it.is_empty());
    let Some(endpoint) = named_by_environment.or_else(|| config.otlp_endpoint.clone()) else { return Ok(None) };
    // Our own client: the library's would not be made on a machine without CA certificates.
    let client = client(&endpoint, None, Some(EXPORT_LIMIT))?;
    let exporter = SpanExporter::builder()
        .with_http()
        .with_http_client(client)
        .with_protocol(Protocol::HttpBinary)
        .with_timeout(EXPORT_LIMIT)
        .with_endpoint(format!("{}/v1/traces", endpoint.trim_end_matches('/')))
        .build();
    exporter.map(Some).map_err(|it| it.to_string())
}
