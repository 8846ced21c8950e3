//! What the terminal can show.

use console::Term;
use std::io::{self, ErrorKind, Write};
use std::sync::OnceLock;

/// Columns of text that is not shown on a terminal.
const FILE_WIDTH: usize = 100;

/// Colours only on a terminal that has them, and never where `NO_COLOR` is set (no-color.org).
pub fn decide_colours() {
    let wanted = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
        && std::env::var_os("TERM").is_none_or(|term| term != "dumb");
    console::set_colors_enabled(wanted && Term::stdout().is_term());
    console::set_colors_enabled_stderr(wanted && Term::stderr().is_term());
}

/// Columns of standard output; none where it is no terminal and nothing needs to be cut.
pub fn stdout_width() -> Option<usize> {
    width(&Term::stdout())
}

/// Columns to wrap messages on standard error at.
pub fn stderr_width() -> usize {
    width(&Term::stderr()).unwrap_or(FILE_WIDTH).max(40)
}

/// Whether progress can be drawn.
pub fn stderr_is_terminal() -> bool {
    Term::stderr().is_term()
}

fn width(term: &Term) -> Option<usize> {
    if !term.is_term() {
        return None;
    }
    Some(
        term.size_checked()
            .map_or(FILE_WIDTH, |(_, columns)| usize::from(columns)),
    )
}

/// Why something could not be written to standard output.
static UNWRITTEN: OnceLock<io::Error> = OnceLock::new();

/// Writes to standard output. A reader that has gone away (`affine-atlas … | head`) is no error; of any other failure [`unwritten`] tells.
pub fn print(text: &str) {
    let mut out = io::stdout().lock();
    note(out.write_all(text.as_bytes()).and_then(|()| out.flush()));
}

/// Notes how writing to standard output went.
pub fn note(written: io::Result<()>) {
    if let Err(error) = written
        && error.kind() != ErrorKind::BrokenPipe
    {
        let _ = UNWRITTEN.set(error);
    }
}

/// Why something could not be written to standard output, if so.
pub fn unwritten() -> Option<&'static io::Error> {
    UNWRITTEN.get()
}

/// Writes to standard error, where a failure could be told to nobody.
pub fn print_error(text: &str) {
    let mut out = std::io::stderr().lock();
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}
