//! KMZ: a ZIP archive with KML inside. All KML files in it are read, so that a link from one to another is followed.

use std::io::{Cursor, Read as _};
use std::path::{Path, PathBuf};

use domain::file::{Mistake, Mistakes};
use zip::ZipArchive;
use zip::result::ZipError;

use crate::bytes::{self, refused};
use crate::json::short;

/// The most that an archive may unpack to, in bytes, and in times of its own size: text is packed to a twentieth, seldom to a fiftieth.
const MOST_BYTES: u64 = 1 << 30;
const MOST_TIMES: u64 = 200;
/// An archive of a few hundred bytes may have a text of this many.
const LEAST_BYTES: u64 = 1 << 20;

/// A KML file in an archive.
pub(crate) struct Inside {
    pub(crate) name: String,
    pub(crate) text: String,
}

/// The KML files of an archive, `doc.kml` first.
///
/// # Errors
/// If the archive has no KML, and then what it has; or if a file cannot be unpacked.
pub(crate) fn unpack(path: &Path, archive: &[u8]) -> Result<Vec<Inside>, Mistakes> {
    let broken = |error: ZipError| wrong(path, format!("a ZIP archive that cannot be unpacked: {error}"));
    let mut zip = ZipArchive::new(Cursor::new(archive)).map_err(broken)?;
    if zip.has_duplicate_names() {
        return Err(wrong(path, "a ZIP archive with two files of one name".into()));
    }
    let names: Vec<String> = zip.file_names_raw().map(|it| String::from_utf8_lossy(it).into_owned()).collect();
    let mut inside: Vec<(usize, &String)> = names.iter().enumerate().filter(|it| is_kml(it.1)).collect();
    if inside.is_empty() || names.iter().any(|it| has_ending(it, &["kmz", "zip"])) {
        let (name, help) = kind(&names);
        return Err(refused(path, &name, help));
    }
    inside.sort_by_key(|(_, name)| !is_main(name));
    let most = (archive.len() as u64).saturating_mul(MOST_TIMES).clamp(LEAST_BYTES, MOST_BYTES);
    let mut left = most;
    let mut texts = Vec::new();
    for (index, name) in inside {
        let name = short(name);
        let cannot = |why: String| wrong(path, format!("`{name}` in it cannot be unpacked: {why}"));
        if zip.by_index_raw(index).is_ok_and(|it| it.encrypted()) {
            return Err(cannot("it is encrypted".into()));
        }
        let file = zip.by_index(index).map_err(|error| cannot(error.to_string()))?;
        let mut unpacked = Vec::new();
        // The declared size is not believed. One byte more shows that there is more.
        file.take(left + 1).read_to_end(&mut unpacked).map_err(|error| cannot(error.to_string()))?;
        left = left.checked_sub(unpacked.len() as u64).ok_or_else(|| {
            cannot(format!(
                "its KML has more than {} MiB, at most {MOST_TIMES} times of the archive is read",
                most >> 20
            ))
        })?;
        let place = PathBuf::from(format!("{}/{name}", path.display()));
        texts.push(Inside { text: bytes::text(&place, unpacked)?, name });
    }
    Ok(texts)
}

/// What an archive is that has no KML, or another archive inside.
fn kind(names: &[String]) -> (String, &'static str) {
    const UNPACK: &str = "unpack it and give the files inside";
    let find = |endings: &[&str]| names.iter().find(|it| has_ending(it, endings));
    if names.iter().any(|it| it == "[Content_Types].xml" || it == "mimetype") {
        return ("an Office document".into(), "export it as GeoJSON or KML");
    }
    if find(&["shp"]).is_some() {
        return ("a ZIP archive with a shapefile".into(), "export it as GeoJSON in WGS 84 from a program for maps");
    }
    if find(&["gdbtable"]).is_some() {
        return ("a ZIP archive with a geodatabase".into(), "export it as GeoJSON in WGS 84 from a program for maps");
    }
    match find(&["kmz", "zip"]).or_else(|| find(&["json", "geojson", "xml", "txt", "gml", "gpkg", "gpx", "plan"])) {
        Some(name) => (format!("a ZIP archive with `{}`", short(name)), UNPACK),
        None => ("a ZIP archive without KML".into(), UNPACK),
    }
}

fn is_kml(name: &str) -> bool {
    // A Mac puts copies of names beside the files.
    has_ending(name, &["kml"]) && !name.starts_with("__MACOSX/")
}

fn is_main(name: &str) -> bool {
    name.eq_ignore_ascii_case("doc.kml")
}

fn has_ending(name: &str, endings: &[&str]) -> bool {
    name.rsplit_once('.').is_some_and(|(_, ending)| endings.iter().any(|it| it.eq_ignore_ascii_case(ending)))
}

fn wrong(path: &Path, message: String) -> Mistakes {
    let help = "unpack it, and give each KML file";
    Mistakes(vec![Mistake { path: path.to_owned(), place: None, message, help: help.into() }])
}
