//! Addresses of a command line: numbers or names.

use anyhow::{Context, anyhow};
use std::io::ErrorKind;
use std::net::{IpAddr, SocketAddr, ToSocketAddrs, UdpSocket};

/// Checks that datagrams can be received at the address of this flag.
///
/// # Errors
/// The obstacle and a remedy.
pub fn receivable(flag: &str, address: SocketAddr) -> anyhow::Result<()> {
    let Err(error) = UdpSocket::bind(address) else {
        return Ok(());
    };
    let why = match error.kind() {
        ErrorKind::AddrInUse => "another program listens there; end it, or take another port",
        ErrorKind::AddrNotAvailable => "no address of this computer; 0.0.0.0 stands for all it has",
        _ => return Err(error).with_context(|| format!("{flag} {address}")),
    };
    Err(anyhow!("{flag} {address}: {why}"))
}

/// `HOST:PORT`, the host in numbers or a name. Prefers an IPv4 address of a name.
///
/// # Errors
/// A description of what is wrong.
pub fn socket_address(text: &str) -> Result<SocketAddr, String> {
    let (host, port) = text
        .rsplit_once(':')
        .ok_or("a port is missing: HOST:PORT")?;
    if port.parse::<u16>().is_err() {
        return Err(format!(
            "{port:?} is no port, which is a number up to 65535"
        ));
    }
    first(host, text.to_socket_addrs())
}

/// `HOST`, in numbers or a name.
///
/// # Errors
/// A description of what is wrong.
pub fn host(text: &str) -> Result<IpAddr, String> {
    let found = (text.trim_matches(['[', ']']), 0).to_socket_addrs();
    first(text, found).map(|address| address.ip())
}

fn first(
    host: &str,
    found: std::io::Result<impl Iterator<Item = SocketAddr>>,
) -> Result<SocketAddr, String> {
    let found: Vec<_> = found
        .map_err(|error| format!("{host:?} is no address, and not known as a name: {error}"))?
        .collect();
    let v4 = found.iter().find(|address| address.is_ipv4());
    let any = v4.or(found.first()).copied();
    any.ok_or_else(|| format!("{host:?} has no address"))
}

#[cfg(test)]
mod tests {
    use super::{host, receivable, socket_address};
    use std::net::UdpSocket;

    #[test]
    fn an_address_that_cannot_be_had_is_said_with_a_remedy() {
        let taken = UdpSocket::bind("127.0.0.1:0").expect("a socket");
        let address = taken.local_addr().expect("an address");
        let said = |address| {
            receivable("--fri", address)
                .expect_err("refused")
                .to_string()
        };
        assert!(said(address).contains("another program listens"));
        // From a block reserved for documentation.
        let foreign = "192.0.2.1:30200".parse().expect("an address");
        assert!(said(foreign).contains("no address of this computer"));
        drop(taken);
        receivable("--fri", address).expect("free");
    }

    #[test]
    fn names_and_numbers_are_addresses() {
        let local = "127.0.0.1:30200".parse().expect("an address");
        assert_eq!(socket_address("127.0.0.1:30200"), Ok(local));
        assert_eq!(socket_address("localhost:30200"), Ok(local));
        let v6 = "[::1]:8080".parse().expect("an address");
        assert_eq!(socket_address("[::1]:8080"), Ok(v6));
        assert_eq!(host("localhost"), Ok(local.ip()));
        assert_eq!(host("10.0.0.7").expect("one").to_string(), "10.0.0.7");
    }

    #[test]
    fn what_is_no_address_is_said() {
        for (text, why) in [
            ("localhost", "port is missing"),
            ("localhost:fri", "no port"),
            ("localhost:70000", "no port"),
            ("no such host:1", "no such host"),
        ] {
            let said = socket_address(text).expect_err("refused");
            assert!(said.contains(why), "{text}: {said}");
        }
        assert!(host("no such host").is_err());
    }
}
