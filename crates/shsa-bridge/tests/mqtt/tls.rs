//! Connections with TLS, and what they tell of their protection.

use crate::broker::Broker;
use crate::{contract, open};
use shsa_bridge::mqtt::{MqttBridge, Options};
use shsa_bridge::{Bridge, BridgeError, Channel};
use std::path::Path;

/// An authority of our own, a broker's certificate signed by it, and an authority that nobody trusts.
fn certificates(folder: &Path) {
    use rcgen::{BasicConstraints, CertificateParams, IsCa, Issuer, KeyPair};
    let authority = |name: &str| {
        let mut params = CertificateParams::new(vec![name.to_owned()]).unwrap();
        params.distinguished_name.push(rcgen::DnType::CommonName, name);
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        let key = KeyPair::generate().unwrap();
        let certificate = params.self_signed(&key).unwrap();
        std::fs::write(folder.join(format!("{name}.pem")), certificate.pem()).unwrap();
        Issuer::new(params, key)
    };
    let (ours, _other) = (authority("ours"), authority("other"));
    for name in ["broker", "healer"] {
        let key = KeyPair::generate().unwrap();
        let mut params =
            CertificateParams::new(vec!["127.0.0.1".to_owned(), "localhost".to_owned()]).unwrap();
        params.distinguished_name.push(rcgen::DnType::CommonName, name);
        let certificate = params.signed_by(&key, &ours).unwrap();
        std::fs::write(folder.join(format!("{name}.pem")), certificate.pem()).unwrap();
        std::fs::write(folder.join(format!("{name}.key")), key.serialize_pem()).unwrap();
    }
}

#[test]
fn only_certificates_of_the_right_authority_are_accepted() {
    let lines = [
        "cafile FOLDER/ours.pem",
        "certfile FOLDER/broker.pem",
        "keyfile FOLDER/broker.key",
        "require_certificate true",
    ];
    let broker = Broker::start_with(&lines, certificates);
    for version in ["5", "3.1.1"] {
        let with = |settings: &str| {
            let settings = settings.replace("FOLDER", &broker.folder().display().to_string());
            let address = format!("mqtts://localhost:{}?version={version}&{settings}", broker.port());
            Options::parse(&address, "healer").unwrap()
        };
        let shown = "cert=FOLDER/healer.pem&key=FOLDER/healer.key";
        let right = format!("ca=FOLDER/ours.pem&{shown}");
        assert_eq!(open(&with(&right)).channel(), Channel { encrypted: true, authenticated: true });
        for wrong in [format!("ca=FOLDER/other.pem&{shown}"), "ca=FOLDER/ours.pem".to_owned()] {
            let error = MqttBridge::open(&with(&wrong), contract::inbox(4)).err();
            assert!(matches!(&error, Some(BridgeError::Refused(_))), "{wrong}: {error:?}");
        }
        let error = MqttBridge::open(&with("ca=FOLDER/none.pem"), contract::inbox(4)).err().unwrap();
        assert!(matches!(&error, BridgeError::Configuration(what) if what.contains("none.pem")), "{error}");
    }
}

#[test]
fn a_connection_tells_what_protects_it() {
    let lines = ["cafile FOLDER/ours.pem", "certfile FOLDER/broker.pem", "keyfile FOLDER/broker.key"];
    let (secret, plain) = (Broker::start_with(&lines, certificates), Broker::start(&[]));
    let check = |address: &str, encrypted: bool, authenticated: bool| {
        let options = Options::parse(address, "healer").unwrap();
        assert_eq!(open(&options).channel(), Channel { encrypted, authenticated }, "{address}");
    };
    let (folder, port) = (secret.folder().display(), secret.port());
    for version in ["5", "3.1.1"] {
        let ours = format!("mqtts://localhost:{port}?version={version}&ca={folder}/ours.pem");
        check(&ours, true, false);
        check(&format!("{ours}&user=ann&password-file={folder}/ours.pem"), true, true);
        check(&format!("{ours}&cert={folder}/healer.pem&key={folder}/healer.key"), true, true);
        check(&format!("mqtt://127.0.0.1:{}?version={version}", plain.port()), false, false);
    }
}
