//! Run a command in a testbed with projectors in chosen ports: `lightcrafter-testbed [--ports 1,2] -- COMMAND...`

use std::process::ExitCode;

#[cfg(target_os = "linux")]
fn main() -> ExitCode {
    match run(std::env::args().skip(1).collect()) {
        Ok(code) => code,
        Err(message) => {
            eprintln!("lightcrafter-testbed: {message}");
            ExitCode::from(2)
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn main() -> ExitCode {
    eprintln!("lightcrafter-testbed: umockdev is for Linux");
    ExitCode::from(2)
}

#[cfg(target_os = "linux")]
fn run(arguments: Vec<String>) -> Result<ExitCode, String> {
    let usage = || "usage: lightcrafter-testbed [--ports 1,2] -- COMMAND...".to_owned();
    let at = arguments.iter().position(|word| word == "--").ok_or_else(usage)?;
    let (options, command) = (&arguments[..at], &arguments[at + 1..]);
    let ports = match options {
        [] => vec![1, 2],
        [name, list] if name == "--ports" => {
            let ports: Result<Vec<u8>, _> = list.split(',').map(str::parse).collect();
            ports.map_err(|_| format!("--ports: expected numbers such as 1,2, got {list}"))?
        }
        _ => return Err(usage()),
    };
    let (program, rest) = command.split_first().ok_or_else(usage)?;
    let testbed = lightcrafter::testbed::Testbed::new(&ports).map_err(|error| error.to_string())?;
    let mut command = testbed.command(program).map_err(|error| error.to_string())?;
    let status = command.args(rest).status().map_err(|error| format!("{program}: {error}"))?;
    for (place, count) in testbed.transactions() {
        eprintln!("lightcrafter-testbed: {count} commands at port {place}");
    }
    Ok(ExitCode::from(status.code().unwrap_or(1) as u8))
}
