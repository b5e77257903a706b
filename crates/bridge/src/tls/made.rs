//! A self-signed certificate for this host.

use graviola::hashing::Sha256;
use graviola::signing::ecdsa::{P256, SigningKey};
use rcgen::{CertificateParams, DnType, ExtendedKeyUsagePurpose, KeyUsagePurpose, SerialNumber};
use std::net::{IpAddr, Ipv4Addr, UdpSocket};

/// First and last year. Fixed, so that a headset whose clock is wrong accepts it, too. Apple's systems take at most 825 days in certificates that
/// begin after June 2019.
const YEARS: [i32; 2] = [2019, 2049];
/// Bytes of an uncompressed point of P-256.
const POINT: usize = 65;

/// Names of this host: its own, and that of multicast DNS.
pub(super) fn names() -> Vec<String> {
    let own = gethostname::gethostname().to_string_lossy().to_lowercase();
    let is_name = !own.is_empty()
        && own
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || matches!(b, b'-' | b'.'));
    match (is_name, own.contains('.')) {
        (false, _) => Vec::new(),
        (true, true) => vec![own],
        (true, false) => vec![format!("{own}.local"), own],
    }
}

/// Addresses of this host for others, the one on the default route first.
pub(super) fn addresses() -> Vec<IpAddr> {
    // Connecting a UDP socket sends nothing. The address is reserved for documentation: RFC 5737.
    let route = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).and_then(|socket| {
        socket.connect((Ipv4Addr::new(192, 0, 2, 1), 9))?;
        Ok(socket.local_addr()?.ip())
    });
    let route = route.ok();
    let mut found: Vec<IpAddr> = if_addrs::get_if_addrs()
        .unwrap_or_default()
        .iter()
        .map(|interface| interface.ip())
        .filter(|ip| !ip.is_loopback() && !is_link_local(ip))
        .collect();
    found.sort_by_key(|ip| (Some(*ip) != route, ip.is_ipv6()));
    found.dedup();
    found
}

/// Browsers do not accept these: they need the name of an interface.
const fn is_link_local(ip: &IpAddr) -> bool {
    match ip {
        IpAddr::V4(_) => false,
        IpAddr::V6(ip) => ip.is_unicast_link_local(),
    }
}

/// A certificate with its key, as PEM. ECDSA on P-256, for the names and addresses that this host has now.
pub(super) fn made() -> Result<String, String> {
    let key = Key::generate().map_err(|error| format!("no key: {error:?}"))?;
    let mut subjects = names();
    subjects.push("localhost".to_owned());
    subjects.extend(["127.0.0.1", "::1"].map(str::to_owned));
    subjects.extend(addresses().iter().map(IpAddr::to_string));
    let made = CertificateParams::new(subjects).and_then(|mut params| {
        let [first, last] = YEARS;
        params.not_before = rcgen::date_time_ymd(first, 1, 1);
        params.not_after = rcgen::date_time_ymd(last, 12, 31);
        params.serial_number = Some(SerialNumber::from_slice(&key.serial));
        params
            .distinguished_name
            .push(DnType::CommonName, "H-Wall bridge");
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
        params.self_signed(&key)
    });
    let certificate = made.map_err(|error| error.to_string())?;
    Ok(format!("{}{}", certificate.pem(), key.pem))
}

/// A key, and its fields in a certificate.
struct Key {
    secret: SigningKey<P256>,
    public: Vec<u8>,
    pem: String,
    serial: [u8; 16],
}

impl Key {
    fn generate() -> Result<Self, graviola::Error> {
        let secret = SigningKey::<P256>::generate()?;
        let mut buffer = [0; 256];
        let spki = secret.to_spki_der(&mut buffer)?;
        // The point is at the end.
        let public = spki[spki.len().saturating_sub(POINT)..].to_vec();
        let pem = pem::Pem::new("PRIVATE KEY", secret.to_pkcs8_der(&mut buffer)?);
        let mut serial = [0; 16];
        graviola::random::fill(&mut serial)?;
        // Positive, and without a leading zero byte.
        serial[0] = serial[0] & 0x7f | 0x40;
        Ok(Self {
            secret,
            public,
            pem: pem::encode(&pem),
            serial,
        })
    }
}

impl rcgen::PublicKeyData for Key {
    fn der_bytes(&self) -> &[u8] {
        &self.public
    }

    fn algorithm(&self) -> &'static rcgen::SignatureAlgorithm {
        &rcgen::PKCS_ECDSA_P256_SHA256
    }
}

impl rcgen::SigningKey for Key {
    fn sign(&self, message: &[u8]) -> Result<Vec<u8>, rcgen::Error> {
        let mut buffer = [0; 128];
        let signed = self
            .secret
            .sign_asn1::<Sha256>(&[message], &mut buffer)
            .map_err(|_| rcgen::Error::RemoteKeyError)?;
        Ok(signed.to_vec())
    }
}
