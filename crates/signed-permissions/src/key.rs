//! The tower's key pair, and both halves as text.

use std::fmt;
use std::str::FromStr;

use domain::permission::Permission;
use ring::rand::{SecureRandom, SystemRandom};
use ring::signature::{ED25519, Ed25519KeyPair, KeyPair, UnparsedPublicKey};

use crate::statement;

const SECRET: &str = "kittiwake-tower-secret";
const PUBLIC: &str = "kittiwake-tower-public";
const ALGORITHM: &str = "ed25519";

/// Signs permissions. A process that has it can let vehicles into areas.
pub struct SecretKey {
    seed: [u8; 32],
    pair: Ed25519KeyPair,
}

/// Verifies permissions. No secret.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PublicKey([u8; 32]);

/// Why a text is not a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum InvalidKey {
    /// It is of another kind, or none.
    #[error("no key of the control tower: expected one line, `{expected} ed25519` and 64 hexadecimal digits")]
    Form {
        /// The first word of the kind that was expected.
        expected: &'static str,
    },
    /// The secret key stands where the public one belongs.
    #[error("the secret key of the control tower: a vehicle gets the public one, `control-tower.pub`")]
    Secret,
}

/// The machine has no random numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the operating system has no random numbers for a key")]
pub struct NoRandomNumbers;

impl SecretKey {
    /// A new key.
    ///
    /// # Errors
    /// If the operating system has no random numbers.
    pub fn generate() -> Result<SecretKey, NoRandomNumbers> {
        let mut seed = [0; 32];
        SystemRandom::new().fill(&mut seed).map_err(|_| NoRandomNumbers)?;
        SecretKey::of_seed(seed).ok_or(NoRandomNumbers)
    }

    /// The key of a seed: of a random one, or of a fixed one where nothing is to be protected. `None`: ring refuses it.
    pub fn of_seed(seed: [u8; 32]) -> Option<SecretKey> {
        Some(SecretKey { seed, pair: Ed25519KeyPair::from_seed_unchecked(&seed).ok()? })
    }

    /// Its other half.
    pub fn public(&self) -> PublicKey {
        let mut bytes = [0; 32];
        bytes.copy_from_slice(self.pair.public_key().as_ref());
        PublicKey(bytes)
    }

    /// The signature under this permission. The same for the same permission, whatever its `valid_for`.
    pub fn sign(&self, permission: &Permission) -> Vec<u8> {
        self.pair.sign(&statement::bytes(permission)).as_ref().to_vec()
    }

    /// As [`str::parse`] reads it. To be kept secret.
    pub fn to_text(&self) -> String {
        line(SECRET, &self.seed)
    }
}

impl PublicKey {
    /// Whether the tower has signed this permission.
    pub fn verifies(&self, permission: &Permission) -> bool {
        let key = UnparsedPublicKey::new(&ED25519, self.0);
        key.verify(&statement::bytes(permission), &permission.signature).is_ok()
    }
}

/// Never the secret.
impl fmt::Debug for SecretKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SecretKey").field("public", &self.public()).finish_non_exhaustive()
    }
}

impl fmt::Display for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&line(PUBLIC, &self.0))
    }
}

impl FromStr for SecretKey {
    type Err = InvalidKey;
    fn from_str(text: &str) -> Result<SecretKey, InvalidKey> {
        let seed = parse(SECRET, text).ok_or(InvalidKey::Form { expected: SECRET })?;
        SecretKey::of_seed(seed).ok_or(InvalidKey::Form { expected: SECRET })
    }
}

impl FromStr for PublicKey {
    type Err = InvalidKey;
    fn from_str(text: &str) -> Result<PublicKey, InvalidKey> {
        if parse(SECRET, text).is_some() {
            return Err(InvalidKey::Secret);
        }
        parse(PUBLIC, text).map(PublicKey).ok_or(InvalidKey::Form { expected: PUBLIC })
    }
}

fn line(kind: &str, bytes: &[u8; 32]) -> String {
    let digits: String = bytes.iter().map(|it| format!("{it:02x}")).collect();
    format!("{kind} {ALGORITHM} {digits}")
}

fn parse(kind: &str, text: &str) -> Option<[u8; 32]> {
    let digits = text.trim().strip_prefix(kind)?.strip_prefix(' ')?.strip_prefix(ALGORITHM)?.strip_prefix(' ')?;
    if digits.len() != 64 || !digits.bytes().all(|it| it.is_ascii_hexdigit()) {
        return None;
    }
    let mut bytes = [0; 32];
    for (byte, at) in bytes.iter_mut().zip((0..64).step_by(2)) {
        *byte = u8::from_str_radix(digits.get(at..at + 2)?, 16).ok()?;
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_survive_their_text_and_are_not_mixed_up() {
        let secret = SecretKey::generate().unwrap();
        let (secret_text, public_text) = (secret.to_text(), secret.public().to_string());
        assert_eq!(format!("{secret_text}\n").parse::<SecretKey>().unwrap().public(), secret.public());
        assert_eq!(public_text.parse(), Ok(secret.public()));
        assert_eq!(secret_text.parse::<PublicKey>(), Err(InvalidKey::Secret));
        assert_eq!(public_text.parse::<SecretKey>().unwrap_err(), InvalidKey::Form { expected: SECRET });
        assert!(!format!("{secret:?}").contains(&secret_text[30..]));
    }

    #[test]
    fn a_text_that_is_no_key_is_refused() {
        let good = SecretKey::of_seed([1; 32]).unwrap().public().to_string();
        for bad in ["", "kittiwake-tower-public ed25519", &good[1..], &good[..good.len() - 1], &format!("{good}0"), "é"]
        {
            assert_eq!(bad.parse::<PublicKey>(), Err(InvalidKey::Form { expected: PUBLIC }), "{bad}");
        }
    }

    #[test]
    fn two_keys_are_different() {
        assert_ne!(SecretKey::generate().unwrap().public(), SecretKey::generate().unwrap().public());
    }
}
