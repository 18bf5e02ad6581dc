//! A radio link between two programs: it forwards the bytes of connections, until it is cut.

use std::io::{self, copy};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

/// A link to a port of this machine. Its threads end with the process.
pub(super) struct Radio {
    /// The port of the near end.
    pub(super) port: u16,
    /// The open connections; `None` while the link is cut.
    open: Arc<Mutex<Option<Vec<TcpStream>>>>,
}

impl Radio {
    /// A link that is there.
    pub(super) fn to(target: u16) -> io::Result<Radio> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        let port = listener.local_addr()?.port();
        let open = Arc::new(Mutex::new(Some(Vec::new())));
        let held = open.clone();
        thread::Builder::new().name("radio".into()).spawn(move || {
            for near in listener.incoming().map_while(Result::ok) {
                // A connection that cannot be made is none; the other side tries again.
                let _ = forward(&held, near, target);
            }
        })?;
        Ok(Radio { port, open })
    }

    /// Ends all connections, and lets none through.
    pub(super) fn cut(&self) {
        let open = self.open.lock().unwrap_or_else(PoisonError::into_inner).take();
        for stream in open.into_iter().flatten() {
            // It may have ended by itself.
            let _ = stream.shutdown(Shutdown::Both);
        }
    }

    /// Lets connections through again.
    pub(super) fn restore(&self) {
        *self.open.lock().unwrap_or_else(PoisonError::into_inner) = Some(Vec::new());
    }
}

/// Forwards a connection in both directions, where the link is there.
fn forward(open: &Mutex<Option<Vec<TcpStream>>>, near: TcpStream, target: u16) -> io::Result<()> {
    let mut open = open.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(open) = &mut *open else { return Ok(()) };
    let far = TcpStream::connect((Ipv4Addr::LOCALHOST, target))?;
    for (from, to) in [(&near, &far), (&far, &near)] {
        let (mut from, mut to) = (from.try_clone()?, to.try_clone()?);
        thread::Builder::new().name("radio".into()).spawn(move || {
            let _ = copy(&mut from, &mut to);
            let _ = to.shutdown(Shutdown::Both);
        })?;
    }
    open.extend([near, far]);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};

    #[test]
    fn a_cut_link_lets_nothing_through() {
        let far = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let radio = Radio::to(far.local_addr().unwrap().port()).unwrap();
        let received = |near: &mut TcpStream| {
            let (mut end, _) = far.accept().unwrap();
            near.write_all(b"42").unwrap();
            let mut bytes = [0; 2];
            end.read_exact(&mut bytes).map(|()| bytes)
        };
        let connect = || TcpStream::connect((Ipv4Addr::LOCALHOST, radio.port)).unwrap();
        let mut near = connect();
        assert_eq!(received(&mut near).unwrap(), *b"42");
        radio.cut();
        assert_eq!(near.read(&mut [0; 2]).unwrap_or(0), 0);
        radio.restore();
        assert_eq!(received(&mut connect()).unwrap(), *b"42");
    }
}
