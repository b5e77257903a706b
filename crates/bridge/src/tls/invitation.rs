//! What a person needs to know to open the page on another device.

use super::Security;
use super::made::{addresses, names};
use qrcode::QrCode;
use qrcode::render::unicode::Dense1x2;
use std::fmt::Write;
use std::net::SocketAddr;

/// The addresses, what the browser asks, and the first address as a QR code. `query`: the end of each. `hosts`: names that the server
/// accepts.
pub(crate) fn invitation(
    url: &str,
    query: &str,
    security: Option<&Security>,
    bound: SocketAddr,
    hosts: &[String],
) -> String {
    let Some(security) = security else {
        return format!("open {url}");
    };
    let port = bound.port();
    let named = |name: &String| format!("https://{name}:{port}/{query}");
    let mut urls: Vec<String> = Vec::new();
    if !security.is_self_signed() {
        // A user's own certificate is for names.
        urls.extend(hosts.iter().map(named));
    }
    if bound.ip().is_unspecified() {
        // 0.0.0.0 does not listen on addresses of IPv6.
        let all = addresses().into_iter();
        let heard = all.filter(|ip| ip.is_ipv4() || bound.is_ipv6());
        urls.extend(heard.map(|ip| format!("https://{}/{query}", SocketAddr::new(ip, port))));
        if security.is_self_signed() {
            urls.extend(names().iter().map(named));
        }
    }
    urls.push(url.to_owned());
    let first = urls.remove(0);
    let mut text = format!("open {first}");
    if !urls.is_empty() {
        let _ = write!(text, "\n  or {}", urls.join(", "));
    }
    if security.is_self_signed() {
        let _ = write!(
            text,
            "\nThe browser will say that the connection is not private: this computer signed the certificate itself. Choose \
             Advanced, then Proceed. It asks once for each device and address. The certificate's SHA-256 fingerprint is\n{}",
            security.fingerprint()
        );
    }
    if let Ok(code) = QrCode::new(&first) {
        // Sets both colours and a light margin, so that dark modules are dark on any console.
        let mut code = code.render::<Dense1x2>();
        let picture = code
            .dark_color(Dense1x2::Dark)
            .light_color(Dense1x2::Light)
            .build();
        let _ = write!(text, "\n{picture}");
    }
    text
}
