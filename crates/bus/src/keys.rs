//! Key expressions: what a process of a scope listens on and publishes to, and what a key says.

use node::VehicleId;

use crate::Scope;

/// All keys of one vehicle start with this and its name.
pub(crate) const ROOT: &str = "kw";

impl Scope {
    /// The namespace zenoh puts before everything the session does; `None`: full keys.
    pub(crate) fn namespace(&self) -> Option<String> {
        match self {
            Scope::Vehicle(vehicle) => Some(format!("{ROOT}/{vehicle}")),
            Scope::Fleet => None,
        }
    }

    /// Where to listen for `key`.
    pub(crate) fn listen(&self, key: &str) -> String {
        match self {
            Scope::Vehicle(_) => key.to_owned(),
            Scope::Fleet => format!("{ROOT}/*/{key}"),
        }
    }

    /// Where to publish `key`, for `vehicle` or, if `None`, for the process itself.
    pub(crate) fn publish(&self, vehicle: Option<&VehicleId>, key: &str) -> String {
        match (self, vehicle) {
            (Scope::Fleet, Some(vehicle)) => format!("{ROOT}/{vehicle}/{key}"),
            _ => key.to_owned(),
        }
    }

    /// A key as one of this scope names it, with the namespace that zenoh puts before it.
    pub(crate) fn whole(&self, key: &str) -> String {
        match self.namespace() {
            Some(namespace) => format!("{namespace}/{key}"),
            None => key.to_owned(),
        }
    }

    /// The vehicle that a received key belongs to; empty for a process that belongs to none.
    pub(crate) fn vehicle_of(&self, key: &str) -> VehicleId {
        match self {
            Scope::Vehicle(vehicle) => vehicle.as_str().into(),
            Scope::Fleet => {
                let mut chunks = key.split('/');
                match (chunks.next(), chunks.next()) {
                    (Some(ROOT), Some(vehicle)) => vehicle.into(),
                    _ => "".into(),
                }
            }
        }
    }
}

/// The liveliness token of one start of a service.
pub(crate) fn alive(service: &str, instance: &str) -> String {
    format!("alive/{service}/{instance}")
}

/// Service and instance of a liveliness token's key.
pub(crate) fn parse_alive(key: &str) -> Option<(&str, &str)> {
    let mut chunks = key.rsplit('/');
    let (instance, service) = (chunks.next()?, chunks.next()?);
    (chunks.next()? == "alive").then_some((service, instance))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_says_whose_it_is() {
        assert_eq!(&*Scope::Fleet.vehicle_of("kw/uav7/mcm/status"), "uav7");
        assert_eq!(&*Scope::Fleet.vehicle_of("alive/gateway/1"), "");
        assert_eq!(&*Scope::Vehicle("uav1".into()).vehicle_of("mcm/status"), "uav1");
        assert_eq!(parse_alive("kw/uav1/alive/mcm/4f"), Some(("mcm", "4f")));
        assert_eq!(parse_alive("mcm/status"), None);
        assert_eq!(Scope::Vehicle("uav1".into()).whole("mcm/status"), "kw/uav1/mcm/status");
        assert_eq!(Scope::Fleet.whole("kw/uav1/mcm/status"), "kw/uav1/mcm/status");
    }
}
