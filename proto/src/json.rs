//! Canonical proto3 JSON of any message, by reflection.

use std::sync::LazyLock;

use prost::{Message, Name};
use prost_reflect::{DescriptorPool, DynamicMessage, SerializeOptions};

static POOL: LazyLock<DescriptorPool> = LazyLock::new(|| {
    let bytes = include_bytes!(concat!(env!("OUT_DIR"), "/descriptor.bin"));
    DescriptorPool::decode(bytes.as_slice()).expect("the descriptor set was written by this crate's build script")
});

/// The message as canonical proto3 JSON: lowerCamelCase names, enums by name, 64-bit integers as
/// strings. Fields at their default are written too, so that a reader sees `false` and `0`.
pub fn to_json<M: Message + Name>(message: &M) -> serde_json::Value {
    let descriptor = POOL.get_message_by_name(&M::full_name()).expect("every compiled message is in the pool");
    let mut dynamic = DynamicMessage::new(descriptor);
    dynamic.transcode_from(message).expect("a message transcodes into its own descriptor");
    let options = SerializeOptions::new().skip_default_fields(false);
    dynamic
        .serialize_with_options(serde_json::value::Serializer, &options)
        .expect("a message of known fields serialises")
}

/// The message in canonical proto3 JSON; a field that is not known is a mistake.
///
/// # Errors
/// What is wrong, in words.
pub fn from_json<M: Message + Name + Default>(json: &serde_json::Value) -> Result<M, String> {
    let descriptor = POOL.get_message_by_name(&M::full_name()).expect("every compiled message is in the pool");
    let dynamic = DynamicMessage::deserialize(descriptor, json).map_err(|it| it.to_string())?;
    dynamic.transcode_to().map_err(|it| it.to_string())
}

/// Every message and enum of the contract.
pub(crate) fn pool() -> &'static DescriptorPool {
    &POOL
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::v1;

    #[test]
    fn enums_go_by_name_and_defaults_are_shown() {
        let json = to_json(&v1::ObjectiveReport { name: "deliver".into(), state: 2, ..Default::default() });
        assert_eq!(json["state"], "OBJECTIVE_STATE_SUCCESS");
        assert_eq!(json["planSteps"], 0);
    }

    #[test]
    fn what_is_written_is_read_and_what_is_unknown_is_refused() {
        let message = v1::DecidePlan { revision: 3, approve: true };
        assert_eq!(from_json(&to_json(&message)), Ok(message));
        let wrong = serde_json::json!({ "revision": "3", "aprove": true });
        assert!(from_json::<v1::DecidePlan>(&wrong).unwrap_err().contains("aprove"));
    }

    #[test]
    fn not_a_number_survives() {
        let json = to_json(&v1::Ned { north_m: f64::NAN, east_m: f64::INFINITY, down_m: 1.0 });
        assert_eq!(json["northM"], "NaN");
        assert_eq!(json["eastM"], "Infinity");
    }
}
