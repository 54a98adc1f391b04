//! Export of spans to an OTLP collector.

use std::time::Duration;

use opentelemetry_otlp::{Protocol, SpanExporter, WithExportConfig, WithHttpConfig};
use opentelemetry_sdk::trace::{BatchConfigBuilder, BatchSpanProcessor};

use crate::http_client::{client, parse};

/// Spans that wait for export; more are dropped.
const QUEUE: usize = 2048;
/// A collector that takes longer for a batch loses it.
const EXPORT_LIMIT: Duration = Duration::from_secs(2);

/// To the collector with this base URL.
pub(super) fn to(endpoint: &str) -> Result<BatchSpanProcessor, String> {
    // Our own client: the library's would not be made on a machine without CA certificates.
    let client = client(&parse(endpoint)?, "", None, Some(EXPORT_LIMIT))?;
    let exporter = SpanExporter::builder()
        .with_http()
        .with_http_client(client)
        .with_protocol(Protocol::HttpBinary)
        .with_timeout(EXPORT_LIMIT)
        .with_endpoint(format!("{}/v1/traces", endpoint.trim_end_matches('/')))
        .build()
        .map_err(|it| it.to_string())?;
    let batches = BatchConfigBuilder::default().with_max_queue_size(QUEUE).build();
    Ok(BatchSpanProcessor::builder(exporter).with_batch_config(batches).build())
}
