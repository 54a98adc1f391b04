//! `kittiwake mission import` and `export`: mission files from and to the formats of other programs.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use domain::file::{self, Mistakes, Source};
use domain::ground::GroundModel;
use domain::mission::Mission;
use formats::assemble::{self, Assembled, assemble};
use formats::export::Target;
use formats::{Import, LeaveOut, Note, Refused, Weight};
use ground::Ground;
use serde_json::{Value, json};

use crate::operate::Done;
use crate::operate::args::{ExportArgs, ExportFormat, ImportArgs};
use crate::operate::failure::Failure;
use crate::operate::route::route;

/// Writes a mission file. What is written passes `kittiwake check`; if it would not, nothing is written.
pub(super) fn import(args: &ImportArgs) -> Result<Done, Failure> {
    let leave_out = LeaveOut::new(&args.leave_out);
    let (mut mistakes, mut notes) = (Vec::new(), Vec::new());
    let mut imports: Vec<Import> = Vec::new();
    for path in std::iter::once(&args.file).chain(&args.areas) {
        match read(path, &leave_out) {
            Ok(import) => imports.push(import),
            Err(found) => {
                mistakes.extend(found.mistakes.0);
                notes.extend(found.notes);
            }
        }
    }
    if !mistakes.is_empty() {
        notes.extend(imports.into_iter().flat_map(|it| it.notes));
        return Err(refused(Refused { mistakes: Mistakes(mistakes), notes }));
    }
    let (mission, areas) = imports.split_first().expect("one file at least was read");
    let stem = args.out.file_stem().map_or_else(|| "mission".into(), |it| it.to_string_lossy().into_owned());
    let ground = args.ground.as_deref().map(Ground::open).transpose().map_err(bad_input)?;
    let settings = assemble::Settings {
        name: stem,
        origin: args.origin,
        relief_m: args.relief,
        ground: ground.as_ref().map(|it| it as &dyn GroundModel),
        strict: args.strict,
        allow_empty: args.allow_empty,
    };
    let assembled = assemble(mission, areas, &settings);
    // A broken tile before what is not known for it.
    ground.map_or(Ok(()), |it| it.check_tiles_read()).map_err(bad_input)?;
    let assembled = assembled.map_err(refused)?;
    Mission::read(&Source { path: args.out.clone(), text: assembled.text.clone() }).map_err(|mistakes| {
        let why = "nothing was written, since the mission could not be flown:".to_owned();
        let said = in_words(&assembled.notes).into_iter().chain([why, mistakes.to_string()]);
        Failure::bad_input(said.collect::<Vec<_>>().join("\n"))
    })?;
    write_new(&args.out, &assembled.text)?;
    let Assembled { objectives, areas, sites, .. } = assembled;
    let written = format!("{}: objectives: {objectives}, areas: {areas}, sites: {sites}", args.out.display());
    Ok(done(&args.out, written, &assembled.notes))
}

/// Prints or writes a mission in another format.
pub(super) fn export(args: &ExportArgs) -> Result<Done, Failure> {
    let source = Source::read(&args.file).map_err(bad_input)?;
    let mission = Mission::read(&source).map_err(bad_input)?;
    let origin = args.origin.or(mission.origin).ok_or_else(|| {
        let path = args.file.display();
        Failure::bad_input(format!("{path}: the mission has no [origin]: give it with --origin LATITUDE,LONGITUDE"))
    })?;
    let target = match args.format {
        ExportFormat::Geojson => Target::GeoJson,
        ExportFormat::Plan => Target::Plan,
    };
    let (legs, refused) = match (args.route, target) {
        (false, _) => (Vec::new(), None),
        (true, Target::GeoJson) => route(&args.file, &args.config).map_err(bad_input)?,
        (true, Target::Plan) => {
            let why = "--route: a plan of QGroundControl cannot show a way besides its items; use --format geojson";
            return Err(Failure::bad_input(why));
        }
    };
    let (text, mut notes) = formats::export::export(&source, &mission, origin, target, &legs);
    notes.extend(refused);
    match &args.out {
        Some(out) => {
            write_new(out, &text)?;
            Ok(done(out, out.display().to_string(), &notes))
        }
        None => {
            // The document alone goes to standard output, so that it can be piped.
            for line in in_words(&notes) {
                crate::output::error_line(line);
            }
            let document = serde_json::from_str(&text).unwrap_or(Value::Null);
            Ok(Done { document, text: text.trim_end().to_owned() })
        }
    }
}

/// Reads a file of another program.
pub fn read(path: &Path, leave_out: &LeaveOut) -> Result<Import, Refused> {
    formats::read_bytes(path, file::read_bytes(path, formats::LARGEST_BYTES)?, leave_out)
}

/// The notes, then the mistakes.
pub fn refused(Refused { mistakes, notes }: Refused) -> Failure {
    let said = in_words(&notes).into_iter().chain([mistakes.to_string()]);
    Failure::bad_input(said.collect::<Vec<_>>().join("\n"))
}

fn bad_input(mistakes: Mistakes) -> Failure {
    Failure::bad_input(mistakes.to_string())
}

/// Never replaces a file: a human may have changed it.
pub fn write_new(path: &Path, text: &str) -> Result<(), Failure> {
    let written = std::fs::File::create_new(path).and_then(|mut file| file.write_all(text.as_bytes()));
    written.map_err(|error| Failure::bad_input(format!("{}: cannot be written: {error}", path.display())))
}

fn done(path: &Path, written: String, notes: &[Note]) -> Done {
    let listed: Vec<Value> = notes
        .iter()
        .map(|it| json!({ "file": it.path.display().to_string(), "place": it.place, "note": it.text }))
        .collect();
    let text = in_words(notes).into_iter().chain([format!("written: {written}")]).collect::<Vec<_>>().join("\n");
    Done { document: json!({ "written": path.display().to_string(), "notes": listed }), text }
}

/// The most places that a line has; `--json` has them all.
const MOST_PLACES: usize = 10;

/// A line for each thing to say about a file, with the places of which it is said; what matters most comes first.
pub fn in_words(notes: &[Note]) -> Vec<String> {
    let mut places: BTreeMap<(Weight, &Path, &str), Vec<&str>> = BTreeMap::new();
    for note in notes {
        places.entry((note.weight, &note.path, &note.text)).or_default().push(&note.place);
    }
    let line = |((_, path, text), places): ((Weight, &Path, &str), Vec<&str>)| {
        let places: Vec<_> = places.into_iter().filter(|it| !it.is_empty()).collect();
        let at = match places.len() {
            0 => String::new(),
            count if count <= MOST_PLACES => format!("\n  at {}", places.join(", ")),
            count => format!("\n  at {} places, the first ones {}", count, places[..MOST_PLACES].join(", ")),
        };
        format!("note: {}: {text}{at}", path.display())
    };
    places.into_iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::Outcome;
    use crate::settings::Settings;
    use domain::geodesy::{LatLon, Origin};
    use std::path::PathBuf;

    /// Where the simulated vehicle stands.
    fn origin() -> Option<Origin> {
        Some(Origin { place: LatLon::new(54.0, 6.6).unwrap(), altitude_m: Some(20.0) })
    }

    fn shipped(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("config/missions").join(name)
    }

    fn config() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("config/kittiwake.toml")
    }

    fn export_of(file: PathBuf, out: Option<PathBuf>) -> ExportArgs {
        ExportArgs { file, format: ExportFormat::Geojson, origin: origin(), route: false, config: config(), out }
    }

    fn import_of(file: PathBuf, areas: Vec<PathBuf>, out: PathBuf) -> ImportArgs {
        ImportArgs {
            file,
            origin: None,
            areas,
            relief: None,
            ground: None,
            strict: false,
            allow_empty: false,
            leave_out: Vec::new(),
            out,
        }
    }

    #[test]
    fn what_is_exported_is_imported_as_a_mission_of_its_own() {
        let folder = tempfile::tempdir().unwrap();
        let (exported, imported) = (folder.path().join("h.geojson"), folder.path().join("copy.toml"));
        export(&export_of(shipped("harbour.toml"), Some(exported.clone()))).unwrap();
        let done = import(&import_of(exported.clone(), Vec::new(), imported.clone())).unwrap();
        assert!(done.text.ends_with("copy.toml: objectives: 2, areas: 3, sites: 2"), "{}", done.text);
        let mission = Mission::read(&Source::read(&imported).unwrap()).unwrap();
        assert_eq!((mission.name.as_str(), mission.areas[0].corners.len(), mission.origin), ("copy", 8, origin()));
        // A file that a human may have changed meanwhile stays.
        let failure = import(&import_of(exported, Vec::new(), imported)).err().unwrap();
        assert_eq!(failure.outcome, Outcome::BadInput);
        assert!(failure.why.contains("copy.toml: cannot be written: "), "{}", failure.why);
    }

    #[test]
    fn the_way_that_would_be_flown_is_exported_and_not_imported() {
        let folder = tempfile::tempdir().unwrap();
        let (exported, imported) = (folder.path().join("k.geojson"), folder.path().join("copy.toml"));
        let args = ExportArgs { route: true, ..export_of(shipped("keep_out.toml"), Some(exported.clone())) };
        export(&args).unwrap();
        let document: Value = serde_json::from_str(&std::fs::read_to_string(&exported).unwrap()).unwrap();
        let features = document["features"].as_array().unwrap();
        let legs: Vec<&Value> = features.iter().filter(|it| it["properties"]["kind"] == "leg").collect();
        let inputs = Settings { mission: Some(shipped("keep_out.toml")), ..Settings::of_file(&config()) };
        let reply = crate::plan::forecast(&crate::check_inputs::read(&inputs).unwrap(), None).unwrap();
        let printed: Vec<&str> = reply.forecast.iter().flat_map(|it| &it.legs).map(|it| it.text.as_str()).collect();
        let texts: Vec<&str> = legs.iter().filter_map(|it| it["properties"]["text"].as_str()).collect();
        assert!(texts == printed && texts.len() > 5, "{texts:?}");
        assert_eq!(legs[1]["geometry"]["coordinates"][0], legs[0]["geometry"]["coordinates"][1]);
        let done = import(&import_of(exported, Vec::new(), imported)).unwrap();
        assert!(done.text.contains("a leg of a plan: left out"), "{}", done.text);
        let plan = ExportArgs { format: ExportFormat::Plan, ..args };
        assert!(export(&plan).err().unwrap().why.contains("use --format geojson"));
    }

    #[test]
    fn what_matters_most_is_said_first_and_what_is_left_out_before_all() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("w.plan");
        let item = |command: u16, place: &str| {
            format!(r#"{{"type": "SimpleItem", "command": {command}, "frame": 3, "params": [0, 0, 0, null, {place}]}}"#)
        };
        let items =
            [item(16, "54.001, 6.6, 30"), item(206, "0, 0, 0"), item(34, "54.002, 6.6, 30"), item(2000, "0, 0, 0")];
        let text = format!(
            r#"{{"fileType": "Plan", "version": 1, "mission": {{"version": 2, "cruiseSpeed": 5, "hoverSpeed": 5,
            "plannedHomePosition": [54, 6.6, 20], "items": [{}]}}}}"#,
            items.join(", ")
        );
        std::fs::write(&file, text).unwrap();
        let args = |out: &str, item: &str| ImportArgs {
            leave_out: vec![item.into()],
            ..import_of(file.clone(), Vec::new(), folder.path().join(out))
        };
        let done = import(&args("m.toml", "/mission/items/2")).unwrap();
        let said: Vec<_> = done.text.lines().map(|it| it.rsplit(": ").next().unwrap()).collect();
        let expected = [
            "left out as asked",
            "  at /mission/items/2",
            "a command to camera, gimbal, speed or other payload",
            "  at /mission/items/1, /mission/items/3",
            "not read",
            "  at /mission/cruiseSpeed, /mission/hoverSpeed",
        ];
        assert_eq!(said[..6], expected, "{}", done.text);
        let failure = import(&args("n.toml", "/mission/items/9")).err().unwrap();
        for expected in [
            "MAV_CMD_DO_ORBIT (34): the way it flies",
            "help: correct it, or leave it out: --leave-out \"/mission/items/2\"",
        ] {
            assert!(failure.why.contains(expected), "{}", failure.why);
        }
    }

    #[test]
    fn heights_above_the_ground_are_imported_with_a_folder_of_tiles() {
        let folder = tempfile::tempdir().unwrap();
        let (file, tile) = (folder.path().join("g.plan"), folder.path().join("N54E006.hgt"));
        let plan = r#"{"fileType": "Plan", "mission": {"plannedHomePosition": [54.5, 6.6, null], "items": [
            {"type": "SimpleItem", "command": 16, "frame": 10, "params": [0, 0, 0, 0, 54.501, 6.6, 40]}]}}"#;
        std::fs::write(&file, plan).unwrap();
        let args = |out: &str| {
            let ground = Some(folder.path().to_owned());
            ImportArgs { ground, ..import_of(file.clone(), Vec::new(), folder.path().join(out)) }
        };
        // Level ground; a broken tile is named before what is not known for it.
        std::fs::write(&tile, 17_i16.to_be_bytes().repeat(1_201 * 1_201)).unwrap();
        import(&args("m.toml")).unwrap();
        let mission = Mission::read(&Source::read(&folder.path().join("m.toml")).unwrap()).unwrap();
        assert_eq!((mission.objectives[0].position.height_m(), mission.origin.unwrap().altitude_m), (40.0, Some(17.0)));
        std::fs::write(&tile, "cut off").unwrap();
        let failure = import(&args("n.toml")).err().unwrap();
        assert!(failure.why.contains("N54E006.hgt: has 7 bytes, expected "), "{}", failure.why);
        assert!(!folder.path().join("n.toml").exists());
    }

    #[test]
    fn a_document_for_a_pipe_stands_alone() {
        let done = export(&export_of(shipped("keep_out.toml"), None)).unwrap();
        assert_eq!(serde_json::from_str::<Value>(&done.text).unwrap(), done.document);
    }

    #[test]
    fn nothing_is_written_of_what_cannot_be_read_or_flown() {
        #[track_caller]
        fn check(text: &str, areas: Option<&str>, expected: &str) {
            let folder = tempfile::tempdir().unwrap();
            let (file, out) = (folder.path().join("file"), folder.path().join("m.toml"));
            std::fs::write(&file, text).unwrap();
            let areas = areas.map(|text| {
                let file = folder.path().join("areas");
                std::fs::write(&file, text).unwrap();
                file
            });
            let failure = import(&import_of(file, areas.into_iter().collect(), out.clone())).err().unwrap();
            assert!(failure.why.contains(expected), "{}", failure.why);
            assert!(failure.outcome == Outcome::BadInput && !out.exists());
        }
        let plan = r#"{"fileType": "Plan", "mission": {"plannedHomePosition": [54, 6.6, 20], "items": [
            {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, 0, 54.001, 6.6, 300]}]}}"#;
        check(plan, None, "at height 300 m, expected at most 120 m");
        // The mistakes of all files are reported at once.
        check("{", Some("<kml"), "areas: no valid XML");
        check(&" ".repeat(33 << 20), None, "the file is empty");
        let folder = tempfile::tempdir().unwrap();
        // A sparse file: its size is refused before anything is read.
        let large = folder.path().join("large");
        std::fs::File::create(&large).unwrap().set_len(formats::LARGEST_BYTES + 1).unwrap();
        // What waits for somebody at its other end, or never ends, is not opened.
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for (file, expected) in [
            (large, "large: the file has 1025 MiB; at most 1024 MiB are read"),
            (pipe, "pipe: cannot be read: it is a pipe, not a regular file"),
            ("/dev/zero".into(), "/dev/zero: cannot be read: it is a device, not a regular file"),
            (folder.path().to_owned(), "it is a folder, not a regular file"),
        ] {
            let failure = import(&import_of(file, Vec::new(), folder.path().join("m"))).err().unwrap();
            assert!(failure.why.contains(expected), "{}", failure.why);
        }
        let missing =
            import(&import_of(folder.path().join("none"), Vec::new(), folder.path().join("m"))).err().unwrap();
        assert!(missing.why.contains("cannot be read: "), "{}", missing.why);
        let failure = export(&ExportArgs { origin: None, ..export_of(shipped("harbour.toml"), None) }).err().unwrap();
        assert!(failure.why.contains("the mission has no [origin]"), "{}", failure.why);
    }
}
