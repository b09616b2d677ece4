//! Run a command in a testbed with projectors in chosen ports: `lightcrafter-testbed [--ports 1,2] [--] COMMAND...`

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
    eprintln!("lightcrafter-testbed: umockdev runs on Linux only");
    ExitCode::from(2)
}

#[cfg(target_os = "linux")]
fn run(arguments: Vec<String>) -> Result<ExitCode, String> {
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (ports, command) = match words.as_slice() {
        ["--ports", list, command @ ..] => (parsed(list)?, command),
        command => (vec![1, 2], command),
    };
    let (program, rest) = match command {
        ["--", program, rest @ ..] => (*program, rest),
        [program, rest @ ..] if !program.starts_with('-') => (*program, rest),
        _ => return Err("usage: lightcrafter-testbed [--ports 1,2] [--] COMMAND...".to_owned()),
    };
    let testbed = lightcrafter::testbed::Testbed::new(&ports).map_err(|error| error.to_string())?;
    let mut command = testbed.command(program).map_err(|error| error.to_string())?;
    let status = command.args(rest).status().map_err(|error| format!("{program}: {error}"))?;
    for (place, count) in testbed.transactions() {
        eprintln!("lightcrafter-testbed: {count} commands at port {place}");
    }
    Ok(ExitCode::from(status.code().unwrap_or(1) as u8))
}

#[cfg(target_os = "linux")]
fn parsed(list: &str) -> Result<Vec<u8>, String> {
    let ports: Result<Vec<u8>, _> = list.split(',').map(str::parse).collect();
    ports.map_err(|_| format!("--ports: expected numbers such as 1,2, got {list}"))
}
