//! What ROS sees of a vehicle, and under which keys and tokens `rmw_zenoh` expects it:
//! `<domain>/<name>/<type>/<hash of the type>`, and for each end a liveliness token that describes it
//! (<https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md>).
//!
//! The hashes are RIHS01 (REP 2011) and follow from the definitions alone. `tests/client/ros.py` computes those of the messages again, with
//! rosbags; those of services come from hiroz-codegen 0.2. A wrong one is not refused: ROS hears nothing.

use std::hash::{DefaultHasher, Hash, Hasher};

use crate::stamp::Stamp;

/// Quality of service as a token writes it: reliable, volatile, the last ten.
const QOS: &str = "::,10:,:,:,,";

/// A topic that the bridge publishes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Topic {
    /// Where the vehicle is on the Earth.
    Fix,
    /// Where it is in its local frame, how it is turned, and how it moves.
    Odometry,
    /// Its battery.
    Battery,
    /// The rest of its plan.
    Plan,
    /// Its processes, contingencies and contact.
    Diagnostics,
    /// What it decides, in words.
    Decisions,
    /// How far the mission of a goal is.
    Feedback,
    /// The state of each goal.
    Status,
}

/// A service that the bridge answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Service {
    /// Starts a mission that waits for it.
    Start,
    /// Holds until resumed.
    Pause,
    /// Goes on.
    Resume,
    /// Flies home and lands.
    Return,
    /// Lands here.
    Abort,
    /// Flies a mission.
    SendGoal,
    /// Tells how it ended, once it has.
    GetResult,
    /// Flies home instead.
    CancelGoal,
}

/// Name, type and hash of a topic or service.
struct Described {
    name: &'static str,
    type_name: &'static str,
    hash: &'static str,
}

const fn described(name: &'static str, type_name: &'static str, hash: &'static str) -> Described {
    Described { name, type_name, hash }
}

impl Topic {
    /// Every topic.
    pub const ALL: [Topic; 8] = [
        Topic::Fix,
        Topic::Odometry,
        Topic::Battery,
        Topic::Plan,
        Topic::Diagnostics,
        Topic::Decisions,
        Topic::Feedback,
        Topic::Status,
    ];

    const fn described(self) -> Described {
        match self {
            Topic::Fix => described(
                "fix",
                "sensor_msgs::msg::dds_::NavSatFix_",
                "62223ab3fe210a15976021da7afddc9e200dc9ec75231c1b6a557fc598a65404",
            ),
            Topic::Odometry => described(
                "odometry",
                "nav_msgs::msg::dds_::Odometry_",
                "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
            ),
            Topic::Battery => described(
                "battery",
                "sensor_msgs::msg::dds_::BatteryState_",
                "4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741",
            ),
            Topic::Plan => described(
                "plan",
                "nav_msgs::msg::dds_::Path_",
                "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b",
            ),
            // Where the tools for diagnostics look, for every node.
            Topic::Diagnostics => described(
                "/diagnostics",
                "diagnostic_msgs::msg::dds_::DiagnosticArray_",
                "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
            ),
            Topic::Decisions => described(
                "decisions",
                "rcl_interfaces::msg::dds_::Log_",
                "e28ce254ca8abc06abf92773b74602cdbf116ed34fbaf294fb9f81da9f318eac",
            ),
            Topic::Feedback => described(
                "fly_mission/_action/feedback",
                "kittiwake_msgs::action::dds_::FlyMission_FeedbackMessage_",
                "cf503bed1332898a68fb3dd19df2a0b8c6376509dbd1ecfc284f99c4ca1ff128",
            ),
            Topic::Status => described(
                "fly_mission/_action/status",
                "action_msgs::msg::dds_::GoalStatusArray_",
                "6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e",
            ),
        }
    }
}

impl Service {
    /// Every service.
    pub const ALL: [Service; 8] = [
        Service::Start,
        Service::Pause,
        Service::Resume,
        Service::Return,
        Service::Abort,
        Service::SendGoal,
        Service::GetResult,
        Service::CancelGoal,
    ];

    const fn described(self) -> Described {
        const fn trigger(name: &'static str) -> Described {
            described(
                name,
                "std_srvs::srv::dds_::Trigger_",
                "eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
            )
        }
        match self {
            Service::Start => trigger("start"),
            Service::Pause => trigger("pause"),
            Service::Resume => trigger("resume"),
            Service::Return => trigger("return"),
            Service::Abort => trigger("abort"),
            Service::SendGoal => described(
                "fly_mission/_action/send_goal",
                "kittiwake_msgs::action::dds_::FlyMission_SendGoal_",
                "92c08775bb54d3e01a3515460b24189cd08544b66ee48f53d15fc99bd2c083d8",
            ),
            Service::GetResult => described(
                "fly_mission/_action/get_result",
                "kittiwake_msgs::action::dds_::FlyMission_GetResult_",
                "b163894ab65cb7f8d997282535e93b3afa039935e261ae632ecfec6fa98338a3",
            ),
            Service::CancelGoal => described(
                "fly_mission/_action/cancel_goal",
                "action_msgs::srv::dds_::CancelGoal_",
                "022cb8eb7bbae4dedde27098187e94f435faa23942695d7fbc7335182d10baf1",
            ),
        }
    }
}

/// The names of one vehicle in one domain.
#[derive(Debug, Clone)]
pub struct Names {
    domain: u8,
    /// As ROS may write it: letters, digits and underscores.
    namespace: String,
    /// The name of the Zenoh session.
    session: String,
}

impl Names {
    /// Of `vehicle`; `session` is the name of the Zenoh session that announces them.
    pub fn new(domain: u8, vehicle: &str, session: &str) -> Names {
        let letter = |it: char| if it.is_ascii_alphanumeric() { it } else { '_' };
        Names { domain, namespace: vehicle.chars().map(letter).collect(), session: session.to_owned() }
    }

    /// The key under which a topic is published.
    pub fn of_topic(&self, topic: Topic) -> String {
        self.key(&topic.described())
    }

    /// The key under which a service is asked.
    pub fn of_service(&self, service: Service) -> String {
        self.key(&service.described())
    }

    /// The service that is asked under this key.
    pub fn service(&self, key: &str) -> Option<Service> {
        Service::ALL.into_iter().find(|it| self.of_service(*it) == key)
    }

    /// The tokens of the node, its publishers and its services.
    pub fn tokens(&self) -> Vec<String> {
        let node = self.token(0, "NN", None);
        let topics = Topic::ALL.map(|it| self.token_of_topic(it));
        let services = (1 + Topic::ALL.len()..).zip(Service::ALL);
        let services = services.map(|(number, it)| self.token(number, "SS", Some(&it.described())));
        std::iter::once(node).chain(topics).chain(services).collect()
    }

    /// The bytes beside each sample: its number, from 1, when it was sent, and who sends it.
    pub fn attachment(&self, topic: Topic, number: i64, sent: Stamp) -> Vec<u8> {
        let sender = |half: u8| {
            let mut hasher = DefaultHasher::new();
            (half, self.token_of_topic(topic)).hash(&mut hasher);
            hasher.finish().to_le_bytes()
        };
        let gid = [sender(0), sender(1)].concat();
        [&number.to_le_bytes()[..], &sent.nanos().to_le_bytes(), &[16], &gid].concat()
    }

    fn token_of_topic(&self, topic: Topic) -> String {
        let number = 1 + Topic::ALL.iter().take_while(|it| **it != topic).count();
        self.token(number, "MP", Some(&topic.described()))
    }

    /// Session, node, entity, kind, enclave, namespace and name of the node; of an end, what it is. `%` stands for `/`.
    fn token(&self, number: usize, kind: &str, end: Option<&Described>) -> String {
        let Names { domain, namespace, session } = self;
        let node = format!("@ros2_lv/{domain}/{session}/0/{number}/{kind}/%/%{namespace}/kittiwake");
        let Some(it) = end else { return node };
        let name = format!("/{}", self.name(it)).replace('/', "%");
        format!("{node}/{name}/{}/RIHS01_{}/{QOS}", it.type_name, it.hash)
    }

    fn key(&self, it: &Described) -> String {
        format!("{}/{}/{}/RIHS01_{}", self.domain, self.name(it), it.type_name, it.hash)
    }

    /// The whole name, without the slash in front.
    fn name(&self, it: &Described) -> String {
        match it.name.strip_prefix('/') {
            Some(name) => name.to_owned(),
            None => format!("{}/{}", self.namespace, it.name),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn names() -> Names {
        Names::new(7, "uav-1", "250c")
    }

    #[test]
    fn keys_and_tokens_are_those_of_rmw_zenoh() {
        let hash = "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e";
        let key = format!("7/diagnostics/diagnostic_msgs::msg::dds_::DiagnosticArray_/{hash}");
        assert_eq!(names().of_topic(Topic::Diagnostics), key);
        assert!(names().of_service(Service::Pause).starts_with("7/uav_1/pause/std_srvs::srv::dds_::Trigger_/RIHS01_"));
        let tokens = names().tokens();
        assert_eq!(tokens[0], "@ros2_lv/7/250c/0/0/NN/%/%uav_1/kittiwake");
        let token = "@ros2_lv/7/250c/0/1/MP/%/%uav_1/kittiwake/%uav_1%fix/sensor_msgs::msg::dds_::NavSatFix_/RIHS01_";
        assert!(tokens[1].starts_with(token), "{}", tokens[1]);
        assert!(tokens.last().is_some_and(|it| it.contains("/16/SS/") && it.contains("/%uav_1%fly_mission%_action%")));
        assert_eq!(tokens.iter().collect::<BTreeSet<_>>().len(), 1 + Topic::ALL.len() + Service::ALL.len());
    }

    #[test]
    fn a_key_says_which_service_is_asked() {
        for service in Service::ALL {
            assert_eq!(names().service(&names().of_service(service)), Some(service));
        }
        assert_eq!(names().service("7/uav_1/pause"), None);
    }

    #[test]
    fn an_attachment_tells_number_time_and_sender() {
        let sent = Stamp { sec: 1, nanosec: 5 };
        let of = |topic| names().attachment(topic, 3, sent);
        assert_eq!(of(Topic::Fix)[..17], [&3_i64.to_le_bytes()[..], &1_000_000_005_i64.to_le_bytes(), &[16]].concat());
        assert_eq!(of(Topic::Fix).len(), 33);
        assert_ne!(of(Topic::Fix)[17..], of(Topic::Plan)[17..]);
    }
}
