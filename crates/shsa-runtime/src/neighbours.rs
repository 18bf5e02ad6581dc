//! The other instances on the bus, and the addresses of their pages.
//!
//! An instance with a page holds the token `shsa/page/INSTANCE/MACHINE/HOST:PORT`. A page that listens on the loopback address only is reached
//! from the same machine alone, so others are told the name of the machine.

use crate::error::{Context, RuntimeError};
use crate::ownership::instance;
use serde_json::{Value, json};
use shsa_bridge::{Attendance, Bridge, Presence};
use std::collections::BTreeMap;
use std::net::{IpAddr, SocketAddr, UdpSocket};
use std::sync::{Mutex, PoisonError};

/// The prefix of the tokens.
const PAGES: &str = "shsa/page";
/// The most instances that are listed.
const MOST: usize = 64;

/// The other instances on the bus.
pub(super) struct Neighbours {
    /// Our name, unique on the network.
    instance: String,
    attendance: Attendance,
    /// The address of each page, by instance; `None` where it cannot be reached from here.
    pages: BTreeMap<String, Option<String>>,
    /// Our token.
    token: Mutex<Option<Box<dyn Send>>>,
}

impl Neighbours {
    /// `None` where the bus does not list the present instances.
    ///
    /// # Errors
    /// When the bus refuses to list them.
    pub(super) fn new(name: &str, bridge: &dyn Bridge) -> Result<Option<Neighbours>, RuntimeError> {
        let attendance = bridge.attendance(&format!("{PAGES}/**")).context("looking for other pages")?;
        Ok(attendance.map(|attendance| Neighbours {
            instance: instance(name, bridge),
            attendance,
            pages: BTreeMap::new(),
            token: Mutex::default(),
        }))
    }

    /// Announces our page at an address. `hosts` are the names by which this host may be asked.
    ///
    /// # Errors
    /// When the name cannot be part of a token.
    pub(super) fn announce(
        &self,
        address: SocketAddr,
        hosts: &[String],
        bridge: &dyn Bridge,
    ) -> Result<(), RuntimeError> {
        let page = format!("{}:{}", host(address.ip(), hosts), address.port());
        let token = bridge.attend(&format!("{PAGES}/{}/{}/{page}", self.instance, machine()));
        *self.token.lock().unwrap_or_else(PoisonError::into_inner) = token.context("announcing the page")?;
        Ok(())
    }

    /// Takes in instances that came or went.
    pub(super) fn follow(&mut self) {
        let machine = machine();
        while let Some(presence) = (self.attendance)() {
            let (Presence::Alive(token) | Presence::Gone(token)) = &presence;
            let Some((instance, page)) = read(token, &machine).filter(|(it, _)| *it != self.instance) else {
                continue;
            };
            match presence {
                Presence::Gone(_) => drop(self.pages.remove(instance)),
                Presence::Alive(_) if self.pages.len() < MOST => {
                    self.pages.insert(instance.to_owned(), page);
                }
                Presence::Alive(_) => {}
            }
        }
    }

    /// The names of the instances with the addresses of their pages; null where a page cannot be reached from here.
    pub(super) fn json(&self) -> impl Iterator<Item = Value> {
        self.pages.iter().map(|(instance, page)| {
            let name = instance.rsplit_once('.').map_or(&**instance, |(name, _)| name);
            json!([name, page])
        })
    }
}

/// The instance of a token, and the address of its page as seen from a machine. Tokens come from strangers.
fn read<'t>(token: &'t str, machine: &str) -> Option<(&'t str, Option<String>)> {
    let (instance, rest) = token.strip_prefix(PAGES)?.strip_prefix('/')?.split_once('/')?;
    let (at, page) = rest.split_once('/')?;
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || ".-:[]".contains(letter);
    if !page.chars().all(is_plain) {
        return None;
    }
    let is_here_only = page.parse::<SocketAddr>().is_ok_and(|address| address.ip().is_loopback());
    let is_reached = !is_here_only || at == machine;
    Some((instance, is_reached.then(|| format!("http://{page}/"))))
}

/// The host in the address of a page: a name by which it may be asked, else its address.
fn host(address: IpAddr, hosts: &[String]) -> String {
    let shown = |address: IpAddr| match address {
        IpAddr::V4(address) => address.to_string(),
        IpAddr::V6(address) => format!("[{address}]"),
    };
    match hosts.first() {
        Some(name) if !address.is_loopback() => name.clone(),
        _ if address.is_unspecified() => shown(outgoing(address).unwrap_or(address)),
        _ => shown(address),
    }
}

/// The address of this machine towards others: that of the way to a network for documentation. Nothing is sent.
fn outgoing(any: IpAddr) -> Option<IpAddr> {
    let far = if any.is_ipv4() { "192.0.2.1:9" } else { "[2001:db8::1]:9" };
    let socket = UdpSocket::bind((any, 0)).ok()?;
    socket.connect(far).ok()?;
    socket.local_addr().ok().map(|address| address.ip())
}

/// The name of this machine, as a part of a token.
fn machine() -> String {
    let known = rustix::system::uname();
    let name = known.nodename().to_string_lossy();
    name.chars().map(|letter| if letter.is_ascii_alphanumeric() { letter } else { '-' }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_tells_the_page_as_far_as_it_can_be_reached() {
        #[track_caller]
        fn check(token: &str, expected: Option<(&str, Option<&str>)>) {
            let expected = expected.map(|(instance, page)| (instance, page.map(str::to_owned)));
            assert_eq!(read(token, "here"), expected);
        }
        check("shsa/page/truck.1/here/127.0.0.1:7410", Some(("truck.1", Some("http://127.0.0.1:7410/"))));
        check("shsa/page/truck.1/there/127.0.0.1:7410", Some(("truck.1", None)));
        check("shsa/page/truck.1/there/10.0.0.2:7410", Some(("truck.1", Some("http://10.0.0.2:7410/"))));
        check(
            "shsa/page/truck.1/there/truck.local:7410",
            Some(("truck.1", Some("http://truck.local:7410/"))),
        );
        check("shsa/page/truck.1/there/evil.org/?a=1", None);
        check("shsa/page/truck.1/there", None);
        check("shsa/healer/truck.1/need", None);
    }

    #[test]
    fn a_page_is_announced_where_it_can_be_asked() {
        let names = ["truck.local".to_owned()];
        let ip = |text: &str| text.parse::<IpAddr>().unwrap();
        assert_eq!(host(ip("127.0.0.1"), &names), "127.0.0.1");
        assert_eq!(host(ip("0.0.0.0"), &names), "truck.local");
        assert_eq!(host(ip("10.0.0.2"), &[]), "10.0.0.2");
        assert_eq!(host(ip("fd00::2"), &[]), "[fd00::2]");
        assert_eq!(machine(), machine());
    }
}
