//! How long orders take, from when their request was read to their outcome, as histograms for `/metrics`.

use std::time::Duration;

use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::Registry;

use crate::http::routes::Route;

/// Wall seconds: an order is a call on board, and over a bad link some seconds.
const BOUNDS_S: [f64; 9] = [0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0];

type Labels = Vec<(&'static str, String)>;

/// The histograms, by route and by whether the order was carried out. Cheap to clone: all clones share them.
#[derive(Clone)]
pub(crate) struct Latencies(Family<Labels, Histogram, fn() -> Histogram>);

impl Default for Latencies {
    fn default() -> Latencies {
        Latencies(Family::new_with_constructor(|| Histogram::new(BOUNDS_S)))
    }
}

impl Latencies {
    /// An order has its outcome.
    pub(crate) fn ended(&self, route: &Route, status: u16, took: Duration) {
        let outcome = if status < 400 { "done" } else { "not_done" };
        let order = format!("{} {}", route.method.name().to_uppercase(), route.path);
        let labels = vec![("order", order), ("outcome", outcome.to_owned())];
        self.0.get_or_create(&labels).observe(took.as_secs_f64());
    }

    /// Shows them among other metrics.
    pub(crate) fn register(&self, registry: &mut Registry) {
        let help = "Wall time from an order's request to its outcome";
        registry.register("order_duration_seconds", help, self.0.clone());
    }
}
