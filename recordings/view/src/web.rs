//! A server of the viewer that runs in a browser: the `rerun` program's own, on this host alone.

use std::{
    io::ErrorKind,
    net::{Ipv4Addr, TcpListener},
    process::{Child, Command, Stdio},
};

use crate::show::ShowError;

/// Where the viewer's programs listen unless something else does.
const GRPC_PORT: u16 = 9876;
const PAGE_PORT: u16 = 9090;
/// Share of the memory in which the server keeps what it was sent for browsers that come later; it drops the oldest
/// beyond it, by default from 1 GiB.
const KEPT: &str = "25%";

/// A server under way.
pub struct Server {
    child: Child,
    grpc_port: u16,
    page_port: u16,
}

impl Server {
    /// Starts it.
    ///
    /// # Errors
    /// There is no `rerun` on the PATH, or no port to listen on.
    pub fn start() -> Result<Self, ShowError> {
        let (grpc_port, page_port) = (free(GRPC_PORT)?, free(PAGE_PORT)?);
        let mut command = Command::new("rerun");
        command.args(["--serve-web", "--bind", "127.0.0.1", "--server-memory-limit", KEPT]);
        command.args(["--port", &grpc_port.to_string(), "--web-viewer-port", &page_port.to_string()]);
        // It tells where it listens; that is said once, when there is something to see.
        command.stdin(Stdio::null()).stdout(Stdio::null()).env("RUST_LOG", "error");
        let child = command.spawn().map_err(|error| match error.kind() {
            ErrorKind::NotFound => ShowError::NoViewer,
            _ => ShowError::Server(error),
        })?;
        Ok(Self { child, grpc_port, page_port })
    }

    /// Where pictures are sent.
    pub fn sink(&self) -> String {
        format!("rerun+http://127.0.0.1:{}/proxy", self.grpc_port)
    }

    /// The page to open.
    pub fn page(&self) -> String {
        format!("http://127.0.0.1:{}/?url=rerun%2Bhttp://127.0.0.1:{}/proxy", self.page_port, self.grpc_port)
    }

    /// Waits until somebody ends it.
    ///
    /// # Errors
    /// The system does not say how it ended.
    pub fn wait(mut self) -> Result<(), ShowError> {
        self.child.wait().map_err(ShowError::Server)?;
        Ok(())
    }
}

/// The wanted port, or another one that is free.
fn free(wanted: u16) -> Result<u16, ShowError> {
    let listen = |port| TcpListener::bind((Ipv4Addr::LOCALHOST, port));
    let listener = listen(wanted).or_else(|_| listen(0)).map_err(ShowError::Server)?;
    Ok(listener.local_addr().map_err(ShowError::Server)?.port())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_that_is_taken_is_left_alone() {
        let taken = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let port = taken.local_addr().unwrap().port();
        let other = free(port).unwrap();
        assert_ne!(other, port);
        drop(taken);
        assert_eq!(free(port).unwrap(), port);
    }
}
