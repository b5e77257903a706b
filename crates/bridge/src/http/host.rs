//! Host names and origins that a browser may use.
//!
//! A foreign page can make its own name point to this machine and then talk to the server from a visitor's browser (DNS rebinding). Its
//! requests carry that name, so the server only accepts names that nobody else can have.

use std::net::IpAddr;

/// The name in a `Host` field, without its port; `None` if it is invalid.
pub(super) fn host_of(field: &str) -> Option<&str> {
    let (name, port) = match field.strip_prefix('[') {
        Some(rest) => {
            let (name, after) = rest.split_once(']')?;
            match after {
                "" => (name, None),
                _ => (name, Some(after.strip_prefix(':')?)),
            }
        }
        None => match field.split_once(':') {
            Some((name, port)) => (name, Some(port)),
            None => (field, None),
        },
    };
    let is_port = port.is_none_or(|port| port.parse::<u16>().is_ok());
    let is_name = !name.is_empty()
        && name
            .bytes()
            .all(|b| b.is_ascii_alphanumeric() || matches!(b, b'.' | b'-' | b':'));
    (is_port && is_name).then_some(name)
}

/// `localhost`, a numeric address, or an allowed name.
pub(super) fn is_allowed_host(name: &str, hosts: &[String]) -> bool {
    name.eq_ignore_ascii_case("localhost")
        || name.parse::<IpAddr>().is_ok()
        || hosts.iter().any(|host| host.eq_ignore_ascii_case(name))
}

/// May a page of this origin talk to a server that it calls `host`? The origin must be the same host; this machine has several names. A page from
/// the visitor's own machine is a foreign one to a server on the network.
pub(super) fn is_allowed_origin(origin: &str, host: &str) -> bool {
    let Some((scheme, authority)) = origin.split_once("://") else {
        return false;
    };
    if !matches!(scheme, "http" | "https") {
        return false;
    }
    let (Some(from), Some(to)) = (host_of(authority), host_of(host)) else {
        return false;
    };
    from.eq_ignore_ascii_case(to) || (is_loopback(from) && is_loopback(to))
}

fn is_loopback(name: &str) -> bool {
    name.eq_ignore_ascii_case("localhost")
        || name
            .parse::<IpAddr>()
            .is_ok_and(|address| address.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_cut_from_their_ports() {
        for (field, name) in [
            ("localhost:8080", Some("localhost")),
            ("[::1]:8080", Some("::1")),
            ("[::1]", Some("::1")),
            ("10.0.0.7", Some("10.0.0.7")),
            ("localhost:port", None),
            ("", None),
            (":80", None),
            ("[::1", None),
            ("[::1]8080", None),
            ("a b", None),
            ("user@localhost", None),
        ] {
            assert_eq!(host_of(field), name, "{field}");
        }
    }

    #[test]
    fn origins_are_of_the_same_host_or_of_this_machine() {
        for (origin, host, allowed) in [
            ("http://localhost:8080", "localhost:8080", true),
            ("https://10.0.0.7", "10.0.0.7:8080", true),
            ("http://127.0.0.1:3000", "localhost:8080", true),
            ("http://localhost.evil.example", "localhost:8080", false),
            ("http://10.0.0.8", "10.0.0.7", false),
            ("http://localhost:3000", "10.0.0.7:8443", false),
            ("file://localhost", "localhost", false),
            ("null", "localhost", false),
            ("http://", "localhost", false),
        ] {
            assert_eq!(is_allowed_origin(origin, host), allowed, "{origin}");
        }
    }
}
