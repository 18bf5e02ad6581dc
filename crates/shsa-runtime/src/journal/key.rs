//! The keys with which journals are signed: Ed25519, in PEM files as `openssl` writes them.

use crate::control::is_open_to_all;
use crate::error::{Context, RuntimeError, unfit};
use ring::signature::{ED25519, Ed25519KeyPair, UnparsedPublicKey};
use rustls_pki_types::pem::PemObject;
use rustls_pki_types::{PrivatePkcs8KeyDer, SubjectPublicKeyInfoDer};
use std::path::Path;
use std::sync::Arc;
use std::{fmt, fs};

/// The structure around an Ed25519 public key of 32 bytes (RFC 8410, section 4).
const AROUND: [u8; 12] = [0x30, 0x2a, 0x30, 0x05, 0x06, 0x03, 0x2b, 0x65, 0x70, 0x03, 0x21, 0x00];

/// A private key. It is never printed.
#[derive(Clone)]
pub struct SigningKey(Arc<Ed25519KeyPair>);

impl fmt::Debug for SigningKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SigningKey(..)")
    }
}

impl SigningKey {
    /// Reads a key in PKCS #8, as `openssl genpkey -algorithm ed25519` writes it.
    ///
    /// # Errors
    /// When the file cannot be read, everyone can read it, or it holds no such key.
    pub fn read(file: &Path) -> Result<SigningKey, RuntimeError> {
        let reading = || format!("reading the key from {}", file.display());
        let text = fs::read(file).with_context(reading)?;
        let shown = file.display();
        if is_open_to_all(file).with_context(reading)? {
            return Err(unfit(format!("everyone on this machine can read {shown}; run: chmod o-r {shown}")));
        }
        let key = PrivatePkcs8KeyDer::from_pem_slice(&text).ok();
        let pair =
            key.and_then(|key| Ed25519KeyPair::from_pkcs8_maybe_unchecked(key.secret_pkcs8_der()).ok());
        let pair = pair.ok_or_else(|| {
            unfit(format!(
                "{shown} holds no private Ed25519 key; make one by: openssl genpkey -algorithm ed25519 -out {shown}"
            ))
        })?;
        Ok(SigningKey(Arc::new(pair)))
    }

    /// The signature of bytes.
    pub(super) fn sign(&self, bytes: &[u8]) -> Option<[u8; 64]> {
        self.0.sign(bytes).as_ref().try_into().ok()
    }
}

/// A public key, by which the signatures of its private key are checked.
#[derive(Clone, Copy, Debug)]
pub struct PublicKey([u8; 32]);

impl PublicKey {
    /// Reads a key as `openssl pkey -pubout` writes it.
    ///
    /// # Errors
    /// When the file cannot be read, or holds no such key.
    pub fn read(file: &Path) -> Result<PublicKey, RuntimeError> {
        let text = fs::read(file).with_context(|| format!("reading the key from {}", file.display()))?;
        let key = SubjectPublicKeyInfoDer::from_pem_slice(&text).ok();
        let key = key.and_then(|key| key.strip_prefix(&AROUND)?.try_into().ok());
        let shown = file.display();
        let help = "write that of a private one by: openssl pkey -in KEY.pem -pubout -out PUBLIC.pem";
        Ok(PublicKey(key.ok_or_else(|| unfit(format!("{shown} holds no public Ed25519 key; {help}")))?))
    }

    /// Whether the signature of these bytes was made by the private key.
    #[must_use]
    pub fn verifies(&self, bytes: &[u8], signature: &[u8; 64]) -> bool {
        UnparsedPublicKey::new(&ED25519, self.0).verify(bytes, signature).is_ok()
    }
}
