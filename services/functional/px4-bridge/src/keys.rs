//! PX4's keys and liveliness tokens: `0/fmu/out/<topic>/px4_msgs::msg::dds_::<Type>_/RIHS01_<hash>`.

/// What a key says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Px4Key<'a> {
    /// Whether PX4 sends on it; otherwise it receives.
    pub is_output: bool,
    /// The topic's name.
    pub topic: &'a str,
    /// The name of its type.
    pub type_name: &'a str,
    /// What stands for the version: a hash of 64 digits, or what PX4 writes where it was built without.
    pub hash: &'a str,
}

const TYPE: (&str, &str) = ("px4_msgs::msg::dds_::", "_");
const HASH: &str = "RIHS01_";

/// The key under which everything of a PX4 in this domain is received.
pub fn outputs(domain: u8) -> String {
    format!("{domain}/fmu/out/**")
}

/// The key of every liveliness token in this domain.
pub fn tokens(domain: u8) -> String {
    format!("@ros2_lv/{domain}/**")
}

/// The key of an input of PX4.
pub fn input(domain: u8, topic: &str, type_name: &str, hash: &str) -> String {
    format!("{domain}/fmu/in/{topic}/{}{type_name}{}/{HASH}{hash}", TYPE.0, TYPE.1)
}

/// Reads a sample's key; `None` for one that is not PX4's.
pub fn read(key: &str, domain: u8) -> Option<Px4Key<'_>> {
    let (own, rest) = key.split_once('/')?;
    if own.parse() != Ok(domain) {
        return None;
    }
    let (is_output, rest) = direction(rest, '/')?;
    let mut parts = rest.split('/');
    let (topic, type_name, hash) = (parts.next()?, parts.next()?, parts.next()?);
    of(is_output, topic, type_name, hash).filter(|_| parts.next().is_none())
}

/// Reads the key of a liveliness token; `None` for one that is not of a topic of PX4.
pub fn read_token(key: &str, domain: u8) -> Option<Px4Key<'_>> {
    let mut parts = key.strip_prefix("@ros2_lv/")?.split('/');
    if parts.next()?.parse() != Ok(domain) {
        return None;
    }
    // Session, node, entity, kind, enclave, namespace, node's name; then the topic with `%` in place of `/`.
    let topic = parts.nth(7)?;
    let (is_output, topic) = direction(topic.strip_prefix('%')?, '%')?;
    of(is_output, topic, parts.next()?, parts.next()?)
}

fn direction(text: &str, separator: char) -> Option<(bool, &str)> {
    let rest = text.strip_prefix("fmu")?.strip_prefix(separator)?;
    let (way, topic) = rest.split_once(separator)?;
    match way {
        "out" => Some((true, topic)),
        "in" => Some((false, topic)),
        _ => None,
    }
}

fn of<'a>(is_output: bool, topic: &'a str, type_name: &'a str, hash: &'a str) -> Option<Px4Key<'a>> {
    let type_name = type_name.strip_prefix(TYPE.0)?.strip_suffix(TYPE.1)?;
    Some(Px4Key { is_output, topic, type_name, hash: hash.strip_prefix(HASH).unwrap_or(hash) })
}

#[cfg(test)]
mod tests {
    use super::*;

    const KEY: &str = "0/fmu/out/vehicle_status/px4_msgs::msg::dds_::VehicleStatus_/RIHS01_b98c";
    const TOKEN: &str = "@ros2_lv/0/250c2f43202cf4b583eea06ad17dd2af/0/11/MS/%/%/px4_aabbcc00/%fmu%in%vehicle_command/px4_msgs::msg::dds_::VehicleCommand_/RIHS01_1f0a/::,7:,:,:,,";

    #[test]
    fn keys_and_tokens_say_topic_type_and_version() {
        let expected = Px4Key { is_output: true, topic: "vehicle_status", type_name: "VehicleStatus", hash: "b98c" };
        assert_eq!(read(KEY, 0), Some(expected));
        let expected = Px4Key { is_output: false, topic: "vehicle_command", type_name: "VehicleCommand", hash: "1f0a" };
        assert_eq!(read_token(TOKEN, 0), Some(expected));
        let key = input(0, "vehicle_command", "VehicleCommand", "1f0a");
        assert_eq!(read(&key, 0), Some(expected));
    }

    #[test]
    fn what_is_not_of_this_px4_is_none() {
        #[track_caller]
        fn check(key: &str) {
            assert_eq!(read(key, 0), None, "{key}");
            assert_eq!(read_token(key, 0), None, "{key}");
        }
        check(&KEY.replacen('0', "1", 1));
        check(&TOKEN.replacen("/0/", "/1/", 1));
        check("0/fmu/out/vehicle_status");
        check("0/rt/chatter/std_msgs::msg::dds_::String_/RIHS01_00");
        check("@ros2_lv/0/250c/0/0/NN/%/%/px4_aabbcc00");
        check("");
    }

    #[test]
    fn a_build_without_hashes_says_so() {
        let key = KEY.replace("RIHS01_b98c", "TypeHashNotSupported");
        assert_eq!(read(&key, 0).map(|it| it.hash), Some("TypeHashNotSupported"));
    }
}
