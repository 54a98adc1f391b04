//! The table as zenoh's settings for a router at one end of the link.

use std::path::Path;

use serde_json::{Value, json};

use super::grants::Act;
use super::{Crossing, Priority, Side, aircraft_name};
use crate::keys::ROOT;
use crate::papers;

/// The link's protocol, and those of one's own side.
const LINK: &[&str] = &["tls"];
const INSIDE: &[&str] = &["tcp", "unixsock-stream"];

/// A topic that is repeated at just its rate must not lose every other message to a jitter.
const RATE_SLACK: f64 = 1.1;

/// A setting's path and its value.
pub(crate) type Setting = (&'static str, Value);

impl Crossing {
    /// The settings of the router on `side`, for these vehicles: its own, or those that the ground lets
    /// in. `papers` is the folder with its certificate.
    pub(crate) fn settings(&self, side: Side, vehicles: &[String], papers: &Path) -> Vec<Setting> {
        let carrier = &self.carrier;
        let open_limit_ms = carrier.open_limit.as_millis() as u64;
        let batches = carrier.queue_batches;
        let papers = papers::in_folder(papers);
        let mut settings = vec![
            ("access_control", self.access(side, vehicles)),
            ("low_pass_filter", self.size_limit()),
            ("qos/network", self.priorities(vehicles)),
            ("transport/link/tx/lease", json!(carrier.lease.as_millis() as u64)),
            ("transport/link/tx/batch_size", json!(carrier.batch_bytes)),
            (
                "transport/link/tx/queue/size",
                json!({
                    "control": batches, "real_time": batches, "interactive_high": batches,
                    "interactive_low": batches, "data_high": batches, "data": batches,
                    "data_low": batches, "background": batches,
                }),
            ),
            ("transport/unicast/open_timeout", json!(open_limit_ms)),
            ("transport/unicast/accept_timeout", json!(open_limit_ms)),
            (
                "transport/link/tls",
                json!({
                    "root_ca_certificate": papers.authority,
                    "listen_certificate": papers.certificate,
                    "listen_private_key": papers.key,
                    "connect_certificate": papers.certificate,
                    "connect_private_key": papers.key,
                    "enable_mtls": true,
                    "verify_name_on_connect": true,
                    "close_link_on_expiration": true,
                    "so_sndbuf": carrier.send_buffer_bytes,
                }),
            ),
        ];
        if side == Side::Aircraft {
            settings.extend(self.thinning(vehicles));
        }
        settings
    }

    /// Deny by default; one's own side may do anything; each peer what is granted to its name.
    fn access(&self, side: Side, vehicles: &[String]) -> Value {
        let everything = json!({
            "id": "inside", "permission": "allow", "flows": ["ingress", "egress"], "key_exprs": ["**"],
            "messages": [
                "put", "delete", "declare_subscriber", "query", "reply", "declare_queryable",
                "liveliness_token", "liveliness_query", "declare_liveliness_subscriber",
            ],
        });
        let (mut rules, mut subjects) = (vec![everything], vec![json!({ "id": "inside", "link_protocols": INSIDE })]);
        let mut policies = vec![json!({ "rules": ["inside"], "subjects": ["inside"] })];
        for vehicle in vehicles {
            let peer = match side {
                Side::Aircraft => self.ground.clone(),
                Side::Ground => aircraft_name(vehicle),
            };
            let mut names = Vec::new();
            for grant in self.grants(vehicle) {
                let flow = if grant.from == side { "egress" } else { "ingress" };
                let id = format!("{vehicle} {}", rules.len());
                rules.push(json!({
                    "id": id, "permission": "allow", "flows": [flow],
                    "messages": messages(grant.act), "key_exprs": [grant.key],
                }));
                names.push(id);
            }
            subjects.push(json!({ "id": vehicle, "link_protocols": LINK, "cert_common_names": [peer] }));
            policies.push(json!({ "rules": names, "subjects": [vehicle] }));
        }
        json!({
            "enabled": true, "default_permission": "deny",
            "rules": rules, "subjects": subjects, "policies": policies,
        })
    }

    fn size_limit(&self) -> Value {
        json!([{
            "id": "link", "link_protocols": LINK, "flows": ["ingress", "egress"],
            "messages": ["put", "delete", "query", "reply"], "key_exprs": ["**"],
            "size_limit": self.carrier.largest_message_bytes,
        }])
    }

    /// Answers travel like their question.
    fn priorities(&self, vehicles: &[String]) -> Value {
        let rows = self.topics.iter().map(|it| (it.topic.key(), it.class));
        let rows = rows.chain(self.services.iter().map(|it| (it.service.key(), it.class)));
        let row = |(name, class): (&str, _)| {
            let keys: Vec<_> = vehicles.iter().map(|vehicle| format!("{ROOT}/{vehicle}/{name}")).collect();
            json!({
                "id": name, "link_protocols": LINK, "flows": ["egress"], "messages": ["put", "query"],
                "key_exprs": keys, "overwrite": { "priority": word(self.priority.of(class)) },
            })
        };
        rows.map(row).collect()
    }

    fn thinning(&self, vehicles: &[String]) -> Option<Setting> {
        let thinned = self.topics.iter().filter_map(|it| Some((it.topic.key(), it.rate_hz?)));
        let rules: Vec<_> = thinned
            .flat_map(|(name, rate_hz)| {
                let rule = move |vehicle: &String| json!({ "key_expr": format!("{ROOT}/{vehicle}/{name}"), "freq": rate_hz * RATE_SLACK });
                vehicles.iter().map(rule)
            })
            .collect();
        let all = json!([{
            "id": "link", "link_protocols": LINK, "flows": ["egress"], "messages": ["put"], "rules": rules,
        }]);
        // Zenoh takes no empty list of rules.
        (!rules.is_empty()).then_some(("downsampling", all))
    }
}

fn messages(act: Act) -> &'static [&'static str] {
    match act {
        Act::Publish => &["put"],
        Act::Subscribe => &["declare_subscriber"],
        Act::Ask => &["query"],
        Act::Answer => &["reply"],
        Act::Serve => &["declare_queryable"],
        Act::Appear => &["liveliness_token"],
        Act::Watch => &["declare_liveliness_subscriber", "liveliness_query"],
    }
}

fn word(priority: Priority) -> &'static str {
    match priority {
        Priority::RealTime => "real_time",
        Priority::InteractiveHigh => "interactive_high",
        Priority::InteractiveLow => "interactive_low",
        Priority::DataHigh => "data_high",
        Priority::Data => "data",
        Priority::DataLow => "data_low",
        Priority::Background => "background",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::{config, set_value};
    use domain::file::Source;

    #[test]
    fn zenoh_knows_every_setting_of_both_sides() {
        let text = include_str!("../../../../config/zenoh/link.toml").to_owned();
        let table = Crossing::read(&Source { path: "link.toml".into(), text }).unwrap();
        for (side, vehicles) in
            [(Side::Aircraft, vec!["uav1".to_owned()]), (Side::Ground, vec!["uav1".into(), "uav2".into()])]
        {
            let mut config = config("router").unwrap();
            for (path, value) in table.settings(side, &vehicles, Path::new("papers")) {
                set_value(&mut config, path, &value).unwrap_or_else(|error| panic!("{error}"));
                let read_back: Value = serde_json::from_str(&config.get_json(path).unwrap()).unwrap();
                assert!(!read_back.is_null(), "{path}");
            }
        }
    }
}
