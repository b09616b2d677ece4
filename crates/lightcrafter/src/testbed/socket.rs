//! Sockets that every user may connect to.

use std::fs::{Permissions, set_permissions};
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::sync::Arc;
use std::thread;

/// Create a socket and serve each of its connections, numbered from 0, in a separate thread until the process ends.
pub fn listen(path: &Path, serve: impl Fn(u64, UnixStream) + Send + Sync + 'static) -> io::Result<()> {
    let listener = UnixListener::bind(path)?;
    set_permissions(path, Permissions::from_mode(0o777))?;
    let serve = Arc::new(serve);
    thread::spawn(move || {
        for (number, stream) in (0..).zip(listener.incoming().flatten()) {
            let serve = Arc::clone(&serve);
            thread::spawn(move || serve(number, stream));
        }
    });
    Ok(())
}
