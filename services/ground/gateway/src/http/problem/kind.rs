//! The kinds of problems, each with a name that never changes, so that a program need not read sentences.

use axum::http::StatusCode;

/// What went wrong, as a program tells it from others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The request cannot be read.
    InvalidRequest,
    /// The body is not what the route takes.
    InvalidBody,
    /// There is no valid token.
    TokenNeeded,
    /// The token lacks a role.
    RoleNeeded,
    /// Somebody else has command of the vehicle, or nobody.
    CommandNeeded,
    /// There is no such thing.
    NotFound,
    /// The vehicle was never seen.
    NoSuchVehicle,
    /// The route does not take this method.
    MethodNotAllowed,
    /// The body did not arrive in time.
    TooSlow,
    /// The vehicle or the control tower refuses.
    Refused,
    /// The body is too large.
    TooLarge,
    /// The recording is shorter.
    NoSuchRange,
    /// The mission has mistakes, or cannot be flown.
    InvalidMission,
    /// The key was used for another order.
    KeyReused,
    /// This client, or its address, asks too often.
    TooMany,
    /// A mistake of the gateway.
    Internal,
    /// A service answers what was not asked.
    InvalidReply,
    /// Nothing can be done at the moment, and nothing was done.
    Unavailable,
    /// It is not known whether the order was carried out.
    OutcomeUnknown,
    /// The system is not complete yet.
    NotReady,
}

/// What the names begin with.
const PREFIX: &str = "urn:kittiwake:problem:";

impl Kind {
    /// Every kind.
    pub(crate) const ALL: [Kind; 20] = [
        Kind::InvalidRequest,
        Kind::InvalidBody,
        Kind::TokenNeeded,
        Kind::RoleNeeded,
        Kind::CommandNeeded,
        Kind::NotFound,
        Kind::NoSuchVehicle,
        Kind::MethodNotAllowed,
        Kind::TooSlow,
        Kind::Refused,
        Kind::TooLarge,
        Kind::NoSuchRange,
        Kind::InvalidMission,
        Kind::KeyReused,
        Kind::TooMany,
        Kind::Internal,
        Kind::InvalidReply,
        Kind::Unavailable,
        Kind::OutcomeUnknown,
        Kind::NotReady,
    ];

    /// The kind of a problem of which nothing but its status is known.
    pub(crate) fn of(status: StatusCode) -> Kind {
        match status {
            StatusCode::UNAUTHORIZED => Kind::TokenNeeded,
            StatusCode::FORBIDDEN => Kind::RoleNeeded,
            StatusCode::NOT_FOUND => Kind::NotFound,
            StatusCode::METHOD_NOT_ALLOWED => Kind::MethodNotAllowed,
            StatusCode::REQUEST_TIMEOUT => Kind::TooSlow,
            StatusCode::CONFLICT => Kind::Refused,
            StatusCode::PAYLOAD_TOO_LARGE => Kind::TooLarge,
            StatusCode::RANGE_NOT_SATISFIABLE => Kind::NoSuchRange,
            StatusCode::UNPROCESSABLE_ENTITY => Kind::InvalidMission,
            StatusCode::TOO_MANY_REQUESTS => Kind::TooMany,
            StatusCode::BAD_GATEWAY => Kind::InvalidReply,
            StatusCode::SERVICE_UNAVAILABLE => Kind::Unavailable,
            it if it.is_server_error() => Kind::Internal,
            _ => Kind::InvalidRequest,
        }
    }

    /// The `type` of the problem.
    pub(crate) fn uri(self) -> String {
        format!("{PREFIX}{}", self.name())
    }

    fn name(self) -> &'static str {
        self.described().0
    }

    /// What a client can do, for people.
    pub(crate) fn summary(self) -> &'static str {
        self.described().1
    }

    fn described(self) -> (&'static str, &'static str) {
        match self {
            Kind::InvalidRequest => ("invalid-request", "The request cannot be read: correct it"),
            Kind::InvalidBody => ("invalid-body", "The body is not what the route takes; `member` says where"),
            Kind::TokenNeeded => ("token-needed", "No token, or one that is unknown or has expired: ask for another"),
            Kind::RoleNeeded => ("role-needed", "The token lacks one of the roles in `needs`"),
            Kind::CommandNeeded => ("command-needed", "Take command of the vehicle first; `command` says who has it"),
            Kind::NotFound => ("not-found", "There is no such route, recording or file"),
            Kind::NoSuchVehicle => ("no-such-vehicle", "The vehicle was never seen since the gateway was started"),
            Kind::MethodNotAllowed => ("method-not-allowed", "The route does not take this method"),
            Kind::TooSlow => ("too-slow", "The body did not arrive in time: send it again"),
            Kind::Refused => ("refused", "The vehicle or the control tower refuses; `detail` says why"),
            Kind::TooLarge => ("too-large", "The body is larger than the gateway takes"),
            Kind::NoSuchRange => ("no-such-range", "The recording is shorter than the range that is asked for"),
            Kind::InvalidMission => ("invalid-mission", "The mission has `mistakes`, each with its line and column"),
            Kind::KeyReused => ("key-reused", "The idempotency key was used for another order: choose another key"),
            Kind::TooMany => {
                ("too-many", "Too many requests, streams, downloads or unread answers: wait as Retry-After says")
            }
            Kind::Internal => ("internal", "A mistake of the gateway: see its log"),
            Kind::InvalidReply => ("invalid-reply", "A service answers what was not asked: see the versions"),
            Kind::Unavailable => ("unavailable", "Nothing was done: repeat it later, an order with the same key"),
            Kind::OutcomeUnknown => (
                "outcome-unknown",
                "Nobody knows whether the order was carried out: repeat it with the same key, a decision about a permission only after a \
                 look at it",
            ),
            Kind::NotReady => ("not-ready", "The system is not complete yet; `missing` says what lacks"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_kind_has_a_name_of_its_own_and_every_status_a_kind() {
        let names: BTreeSet<_> = Kind::ALL.iter().map(|it| it.uri()).collect();
        assert_eq!(names.len(), Kind::ALL.len());
        for status in (400..600).filter_map(|it| StatusCode::from_u16(it).ok()) {
            assert!(names.contains(&Kind::of(status).uri()), "{status}");
        }
        assert_eq!(Kind::of(StatusCode::CONFLICT).uri(), "urn:kittiwake:problem:refused");
        assert_eq!(Kind::of(StatusCode::INSUFFICIENT_STORAGE), Kind::Internal);
        assert_eq!(Kind::of(StatusCode::IM_A_TEAPOT), Kind::InvalidRequest);
    }
}
