//! Where a ground station is.

use std::fmt;
use std::net::SocketAddr;
use std::str::FromStr;

use serde::Deserialize;

/// Where a ground station is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub enum GroundEndpoint {
    /// Ground stations send to this address, and are answered where they are.
    UdpIn(SocketAddr),
    /// A ground station listens at this address.
    UdpOut(SocketAddr),
}

impl FromStr for GroundEndpoint {
    type Err = String;
    fn from_str(text: &str) -> Result<GroundEndpoint, String> {
        let expected = || {
            format!(
                "found ground station `{text}`, expected `udpout:ADDRESS:PORT` of one that listens, or `udpin:ADDRESS:PORT` to listen \
                 for some, such as udpout:127.0.0.1:14550"
            )
        };
        let (kind, address) = text.split_once(':').ok_or_else(expected)?;
        let address = address.parse().map_err(|_| expected())?;
        match kind {
            "udpin" => Ok(GroundEndpoint::UdpIn(address)),
            "udpout" => Ok(GroundEndpoint::UdpOut(address)),
            _ => Err(expected()),
        }
    }
}

impl TryFrom<String> for GroundEndpoint {
    type Error = String;
    fn try_from(text: String) -> Result<GroundEndpoint, String> {
        text.parse()
    }
}

impl fmt::Display for GroundEndpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            GroundEndpoint::UdpIn(address) => write!(f, "udpin:{address}"),
            GroundEndpoint::UdpOut(address) => write!(f, "udpout:{address}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endpoint_is_read_and_written() {
        for text in ["udpin:0.0.0.0:14550", "udpout:127.0.0.1:14550", "udpout:[::1]:14550"] {
            assert_eq!(text.parse::<GroundEndpoint>().map(|it| it.to_string()), Ok(text.to_owned()));
        }
        for text in ["", "udpin", "udpout:14550", "tcpout:127.0.0.1:5760", "serial:/dev/ttyACM0:57600"] {
            let error = text.parse::<GroundEndpoint>().expect_err(text);
            assert!(error.contains("expected `udpout:"), "{error}");
        }
    }
}
