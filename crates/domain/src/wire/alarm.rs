//! How loudly a contingency calls for a human.

use kittiwake_proto::v1;

use crate::contingency::alarm::Alarm;

impl From<Alarm> for v1::Alarm {
    fn from(alarm: Alarm) -> v1::Alarm {
        match alarm {
            Alarm::Advisory => v1::Alarm::Advisory,
            Alarm::Caution => v1::Alarm::Caution,
            Alarm::Warning => v1::Alarm::Warning,
        }
    }
}
