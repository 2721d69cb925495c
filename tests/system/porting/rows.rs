//! The rows that `calls.rs` holds.

const CALLS: &str = include_str!("calls.rs");

/// A C call, and the same call in Rust.
pub(crate) struct Row {
    /// The C call with its arguments.
    call: String,
    result: Option<String>,
    /// When this row applies.
    note: Option<String>,
    pub(crate) code: String,
}

impl Row {
    fn new(comment: &str, code: &str) -> Self {
        let (call, rest) = match comment.split_once(" → ") {
            Some((call, rest)) => (call, Some(rest)),
            None => (comment, None),
        };
        // The note is after the last parenthesis of the call, or after the result.
        let (call, note) = match call.rsplit_once("), ") {
            Some((start, note)) if !note.contains(')') => (format!("{start})"), Some(note)),
            _ => (call.to_owned(), None),
        };
        let (result, later_note) = match rest.and_then(|rest| rest.split_once(", ")) {
            Some((result, note)) => (Some(result), Some(note)),
            None => (rest, None),
        };
        Self {
            call,
            result: result.map(str::to_owned),
            note: later_note.or(note).map(str::to_owned),
            code: code.to_owned(),
        }
    }

    /// The name of the function that is called.
    pub(crate) fn name(&self) -> &str {
        let call = self.call.strip_prefix("new ").unwrap_or(&self.call);
        call.split('(').next().unwrap_or(call)
    }

    /// Its line in the table.
    pub(crate) fn line(&self) -> String {
        let Self { call, result, note, code } = self;
        let result = result.as_ref().map(|result| format!(" → `{result}`")).unwrap_or_default();
        let note = note.as_ref().map(|note| format!(", {note}")).unwrap_or_default();
        // A bar would end the cell.
        format!("| `{call}`{result}{note} | `{}` |", code.replace('|', "\\|"))
    }
}

/// The rows of the function with this heading; none when there is no such function.
pub(crate) fn rows(heading: &str) -> Vec<Row> {
    let text = CALLS.replace("\r\n", "\n");
    let begin = format!("\n/// {heading}\n");
    let Some((_, section)) = text.split_once(&begin) else { return Vec::new() };
    let section = section.split("\n}\n").next().unwrap_or(section);
    let mut rows = Vec::new();
    for paragraph in section.split("\n\n") {
        // The lines above a function's first row are its head.
        let lines = paragraph.lines().map(str::trim).skip_while(|line| !line.starts_with("// "));
        let (comments, code): (Vec<_>, Vec<_>) = lines.partition(|line| line.starts_with("// "));
        // A function ends with its result, which is not part of a row.
        let code = code.into_iter().filter(|line| *line != "Ok(())").collect::<Vec<_>>().join(" ");
        rows.extend(comments.iter().map(|comment| Row::new(&comment["// ".len()..], &code)));
    }
    rows
}
