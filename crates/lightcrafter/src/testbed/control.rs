//! Control of the testbed by lines of text over a socket: faults, unplugging, permissions.

use super::node::Node;
use super::socket;
use crate::emulator::Fault;
use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::Arc;

/// The environment variable with the path of the control socket.
pub const CONTROL: &str = "LIGHTCRAFTER_TESTBED";

/// Serve lines "PORT VERB [ARGUMENT] [COUNT]" and answer each with "ok [VALUE]" or "error REASON".
pub fn listen(path: &Path, nodes: Vec<Arc<Node>>) -> io::Result<()> {
    socket::listen(path, move |_, stream| {
        // An error means that the client closed the connection.
        let _ = serve(&nodes, stream);
    })
}

fn serve(nodes: &[Arc<Node>], stream: UnixStream) -> io::Result<()> {
    let mut answers = stream.try_clone()?;
    for line in BufReader::new(stream).lines() {
        let answer = match obey(nodes, &line?) {
            Ok(value) => format!("ok {value}\n"),
            Err(reason) => format!("error {reason}\n"),
        };
        answers.write_all(answer.as_bytes())?;
    }
    Ok(())
}

fn obey(nodes: &[Arc<Node>], line: &str) -> Result<String, String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (place, order) = words.split_first().ok_or("expected PORT VERB, got an empty line")?;
    let node = nodes
        .iter()
        .find(|node| node.place == *place)
        .ok_or_else(|| format!("no projector at port {place}"))?;
    let failed = |error: io::Error| error.to_string();
    match order {
        ["fault", name, count] => {
            let fault: Fault = name.parse().map_err(|error: crate::Error| error.to_string())?;
            node.model()
                .inject(fault, count.parse().map_err(|_| format!("fault: expected a count, got {count}"))?);
        }
        ["unplug"] => node.model().unplug(),
        ["plug"] => {
            node.model().power_cycle();
            node.shared().incoming.clear();
        }
        ["video", state @ ("on" | "off")] => node.model().video = *state == "on",
        ["video", "appears"] => node.model().video_appears(),
        ["deny"] => node.deny().map_err(failed)?,
        ["allow"] => node.allow().map_err(failed)?,
        ["transactions"] => return Ok(node.model().transactions().to_string()),
        other => return Err(format!("unknown order: {}", other.join(" "))),
    }
    node.reflect().map_err(failed)?;
    Ok(String::new())
}

/// Client for the testbed that this process runs in.
#[derive(Debug)]
pub struct Control {
    stream: BufReader<UnixStream>,
}

impl Control {
    /// Connect to the testbed named by the environment variable [`CONTROL`]. Outside a testbed this is an error.
    pub fn connect() -> io::Result<Self> {
        let path = std::env::var_os(CONTROL).ok_or_else(|| {
            io::Error::new(
                io::ErrorKind::NotFound,
                format!("{CONTROL} is not set: run the program with lightcrafter-testbed"),
            )
        })?;
        Ok(Self { stream: BufReader::new(UnixStream::connect(path)?) })
    }

    /// Give an order to the device in a port: `fault NAME COUNT`, `plug`, `unplug`, `video on|off|appears`, `deny`,
    /// `allow`, `transactions`. Returns the requested value.
    pub fn order(&mut self, place: &str, order: &str) -> io::Result<String> {
        self.stream.get_mut().write_all(format!("{place} {order}\n").as_bytes())?;
        let mut answer = String::new();
        self.stream.read_line(&mut answer)?;
        match answer.trim_end().strip_prefix("ok") {
            Some(value) => Ok(value.trim().to_owned()),
            None => Err(io::Error::other(answer)),
        }
    }
}
