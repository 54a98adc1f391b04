//! `kittiwake audit`: checks the files of the audit trail, without a gateway.

use gateway::audit::found::{CutOff, Fault, Trail};
use gateway::audit::verify::verify;

use crate::operate::args::{AuditArgs, AuditCommand};
use crate::outcome::Outcome;
use crate::output;

/// `kittiwake audit`.
pub fn audit(args: &AuditArgs) -> Outcome {
    let AuditCommand::Verify { path } = &args.what;
    match verify(path) {
        Ok(found) => {
            text(&found).into_iter().for_each(output::line);
            // Exit code 1, as for a chain that is broken.
            if found.is_intact() { Outcome::Success } else { Outcome::Unavailable }
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
fn text(found: &Trail) -> Vec<String> {
    let torn = |it: &CutOff| {
        let (place, more) = (&it.place, remains(it));
        format!(
            "{place}: cut off when the gateway ended, or when the disk took only a part; the next line says so and \
             the chain goes on{more}"
        )
    };
    let mut lines: Vec<_> = found.torn.iter().map(torn).collect();
    if let Some(it) = &found.unfinished {
        let (place, more) = (&it.place, remains(it));
        lines.push(format!(
            "{place}: the last line is cut off; the gateway goes on after it when it starts again{more}"
        ));
    }
    lines.extend(found.lost.iter().map(|it| {
        format!("{it}: begun because the file before was removed, renamed or replaced while the gateway wrote to it")
    }));
    lines.extend(found.misdated.iter().map(|it| {
        let (place, day) = (&it.place, &it.day);
        format!("{place}: the record is of {day}, unlike the file's name: it was renamed, or the clock was set back when it was begun")
    }));
    lines.extend(
        found.open_end.iter().map(|why| {
            format!("`last-audit-number` {why}: records that are missing after the last one are not noticed")
        }),
    );
    let files = if found.files == 1 { "1 file".to_owned() } else { format!("{} files", found.files) };
    let records = match found.last {
        0 => format!("no record yet, {files}"),
        last => format!("records {} to {last}, {files}; the last line's hash is {}", found.first, found.hash),
    };
    lines.push(match found.missing {
        0 => format!("intact: {records}"),
        missing => format!("not intact, {}: {records}", missing_records(missing)),
    });
    lines
}

/// Of a cut-off line that a gateway which was killed does not leave.
fn remains(line: &CutOff) -> &'static str {
    if line.is_beginning {
        ""
    } else {
        "; it is not the beginning of a record: a power loss leaves such bytes, or somebody wrote them"
    }
}

fn missing_records(missing: u64) -> String {
    let records =
        if missing == 1 { "1 record is missing".to_owned() } else { format!("{missing} records are missing") };
    format!("{records}, removed from the end or never written (a full disk, a gateway that was killed just then)")
}

#[cfg(test)]
mod tests {
    use super::*;
    use gateway::audit::found::{Misdated, Place};

    #[test]
    fn what_was_found_is_told_in_lines() {
        let place = |line| Place { path: "audit-2026-01-01.jsonl".into(), line };
        let cut_off = |line, is_beginning| CutOff { place: place(line), is_beginning };
        let mut found = Trail { files: 1, ..Trail::default() };
        assert_eq!(text(&found), ["intact: no record yet, 1 file"]);
        (found.files, found.first, found.last, found.hash) = (2, 3, 9, "ab".into());
        assert_eq!(text(&found), ["intact: records 3 to 9, 2 files; the last line's hash is ab"]);
        (found.torn, found.unfinished) = (vec![cut_off(4, true)], Some(cut_off(7, false)));
        (found.missing, found.lost) = (2, vec![place(5)]);
        found.misdated = vec![Misdated { place: place(6), day: "2026-01-03".into() }];
        found.open_end = Some("is not a number".into());
        let expected = [
            "audit-2026-01-01.jsonl:4: cut off when the gateway ended, or when the disk took only a part; the next line says so and the chain goes on",
            "audit-2026-01-01.jsonl:7: the last line is cut off; the gateway goes on after it when it starts again; it is not the \
             beginning of a record: a power loss leaves such bytes, or somebody wrote them",
            "audit-2026-01-01.jsonl:5: begun because the file before was removed, renamed or replaced while the gateway wrote to it",
            "audit-2026-01-01.jsonl:6: the record is of 2026-01-03, unlike the file's name: it was renamed, or the clock was set back \
             when it was begun",
            "`last-audit-number` is not a number: records that are missing after the last one are not noticed",
            "not intact, 2 records are missing, removed from the end or never written (a full disk, a gateway that was killed just \
             then): records 3 to 9, 2 files; the last line's hash is ab",
        ];
        assert_eq!(text(&found), expected);
    }
}
