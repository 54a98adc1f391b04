//! `kittiwake audit`: checks the files of the audit trail, without a gateway.

use gateway::audit::verify::{Fault, Intact, verify};

use crate::operate::args::{AuditArgs, AuditCommand};
use crate::outcome::Outcome;
use crate::output;

/// `kittiwake audit`.
pub fn audit(args: &AuditArgs) -> Outcome {
    let AuditCommand::Verify { path } = &args.what;
    match verify(path) {
        Ok(found) => {
            text(&found).into_iter().for_each(output::line);
            Outcome::Success
        }
        Err(fault) => {
            output::error_line(format_args!("audit: {fault}"));
            match fault {
                // Exit code 1.
                Fault::Broken(..) => Outcome::Unavailable,
                Fault::Unreadable(..) | Fault::Empty(_) => Outcome::BadInput,
            }
        }
    }
}

/// What was found, line by line.
fn text(found: &Intact) -> Vec<String> {
    let mut lines: Vec<_> = found
        .torn
        .iter()
        .map(|it| format!("{it}: cut off when the gateway ended; the next line says so and the chain goes on"))
        .collect();
    if let Some(it) = &found.unfinished {
        lines.push(format!("{it}: the last line is cut off; the gateway goes on after it when it starts again"));
    }
    lines.extend(found.lost.iter().map(|it| {
        format!("{it}: begun because the file before was removed, renamed or replaced while the gateway wrote to it")
    }));
    if 0 < found.unwritten {
        lines.push(format!("missing: {} records, which could not be written", found.unwritten));
    }
    let files = if found.files == 1 { "1 file".to_owned() } else { format!("{} files", found.files) };
    lines.push(match found.last {
        0 => format!("intact: no record yet, {files}"),
        last => format!("intact: records {} to {last}, {files}; the last line's hash is {}", found.first, found.hash),
    });
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use gateway::audit::verify::Place;

    #[test]
    fn what_was_found_is_told_in_lines() {
        let place = |line| Place { path: "audit-2026-01-01.jsonl".into(), line };
        let mut found = Intact { files: 1, ..Intact::default() };
        assert_eq!(text(&found), ["intact: no record yet, 1 file"]);
        (found.files, found.first, found.last, found.hash) = (2, 3, 9, "ab".into());
        (found.unwritten, found.torn, found.unfinished) = (2, vec![place(4)], Some(place(7)));
        found.lost = vec![place(5)];
        let expected = [
            "audit-2026-01-01.jsonl:4: cut off when the gateway ended; the next line says so and the chain goes on",
            "audit-2026-01-01.jsonl:7: the last line is cut off; the gateway goes on after it when it starts again",
            "audit-2026-01-01.jsonl:5: begun because the file before was removed, renamed or replaced while the gateway wrote to it",
            "missing: 2 records, which could not be written",
            "intact: records 3 to 9, 2 files; the last line's hash is ab",
        ];
        assert_eq!(text(&found), expected);
    }
}
