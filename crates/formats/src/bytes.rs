//! What a file is by its first bytes, and the text of those that are texts.

use std::path::Path;

use domain::file::{Mistake, Mistakes};
use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

use crate::json::short;
use crate::{openair, recognise};

const UNPACK: &str = "unpack it and give the files inside";
const EXPORT: &str = "export it as GeoJSON in WGS 84 from a program for maps";
const SAVE: &str = "save it as UTF-8";
const NO_AREAS: &str = "docs/formats.md says which formats are read";

/// How files begin that are not texts, or not in UTF-8.
const BEGINNINGS: [(&[u8], &str, &str); 28] = [
    (b"\xff\xfe\0\0", "a text in UTF-32", SAVE),
    (b"\0\0\xfe\xff", "a text in UTF-32", SAVE),
    (b"\xff\xfe", "a text in UTF-16", SAVE),
    (b"\xfe\xff", "a text in UTF-16", SAVE),
    (b"<\0", "a text in UTF-16", SAVE),
    (b"\0<", "a text in UTF-16", SAVE),
    (b"{\0", "a text in UTF-16", SAVE),
    (b"\0{", "a text in UTF-16", SAVE),
    (b"PK\x03\x04", "a ZIP archive", UNPACK),
    (b"PK\x05\x06", "an empty ZIP archive", UNPACK),
    (b"\x1f\x8b", "packed by gzip", UNPACK),
    (b"BZh", "packed by bzip2", UNPACK),
    (b"\xfd7zXZ", "packed by xz", UNPACK),
    (b"\x28\xb5\x2f\xfd", "packed by Zstandard", UNPACK),
    (b"7z\xbc\xaf", "a 7z archive", UNPACK),
    (b"Rar!", "a RAR archive", UNPACK),
    (b"\0\0\x27\x0a", "a shapefile", EXPORT),
    (b"SQLite format 3\0", "a GeoPackage, or another database of SQLite", EXPORT),
    (b"%PDF", "a PDF", "download the data that it describes"),
    (b"\x89PNG", "a picture (PNG)", NO_AREAS),
    (b"\xff\xd8\xff", "a picture (JPEG)", NO_AREAS),
    (b"GIF8", "a picture (GIF)", NO_AREAS),
    (b"II*\0", "a picture (TIFF or GeoTIFF)", NO_AREAS),
    (b"MM\0*", "a picture (TIFF or GeoTIFF)", NO_AREAS),
    (b"GRIB", "a weather forecast (GRIB)", NO_AREAS),
    (b"\x89HDF", "a file of HDF5 or NetCDF", NO_AREAS),
    (b"\xd0\xcf\x11\xe0", "an Office document", EXPORT),
    (b"\x7fELF", "a program", NO_AREAS),
];
/// Texts have no zero byte; in files that are not texts there is one soon.
const LOOKED_AT: usize = 1024;

/// Whether it is an archive that may have KML inside.
pub(crate) fn is_archive(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

/// The text of a file, in the encoding that it declares.
///
/// # Errors
/// The name of what it is, if it is not a text.
pub(crate) fn text(path: &Path, bytes: Vec<u8>) -> Result<String, Mistakes> {
    if let Some((_, name, help)) = BEGINNINGS.iter().find(|(beginning, ..)| bytes.starts_with(beginning)) {
        return Err(refused(path, name, help));
    }
    if bytes.iter().take(LOOKED_AT).any(|it| *it == 0) {
        return Err(refused(path, "a binary file of an unknown kind", NO_AREAS));
    }
    if let Some(label) = declared(&bytes) {
        match Encoding::for_label(label.as_bytes()) {
            // What can be read byte by byte as far as here is not UTF-16, whatever it says: programs write that into UTF-8.
            Some(encoding) if [UTF_8, UTF_16LE, UTF_16BE].contains(&encoding) => {}
            Some(encoding) if encoding.is_ascii_compatible() => {
                let text = encoding.decode_without_bom_handling_and_without_replacement(&bytes);
                let broken = || mistake(path, format!("it is not in the encoding `{}` that it declares", short(label)));
                return text.map(|it| it.into_owned()).ok_or_else(broken);
            }
            _ => return Err(mistake(path, format!("it is in the encoding `{}`, which is not read", short(label)))),
        }
    }
    String::from_utf8(bytes).or_else(|error| {
        let valid = error.utf8_error().valid_up_to();
        let bytes = error.into_bytes();
        let (text, _) = WINDOWS_1252.decode_without_bom_handling(&bytes);
        if openair::is_openair(&text) {
            return Ok(text.into_owned());
        }
        if let Some((name, help)) = recognise::foreign(&text) {
            return Err(refused(path, &name, help));
        }
        let before = &bytes[..valid];
        let line = before.iter().filter(|it| **it == b'\n').count() + 1;
        let column = valid - before.iter().rposition(|it| *it == b'\n').map_or(0, |it| it + 1) + 1;
        let found = bytes.get(valid).copied().unwrap_or_default();
        Err(mistake(path, format!("line {line} column {column}: the byte {found:#04x} is not UTF-8")))
    })
}

/// The encoding in the declaration of an XML file.
fn declared(bytes: &[u8]) -> Option<&str> {
    let head = &bytes[..bytes.len().min(256)];
    let end = head.windows(2).position(|it| it == b"?>")?;
    let declaration = std::str::from_utf8(&head[..end]).ok()?.strip_prefix("<?xml")?;
    let value = declaration.split_once("encoding")?.1.trim_start().strip_prefix('=')?.trim_start();
    let quote = value.chars().next().filter(|it| ['"', '\''].contains(it))?;
    value[1..].split(quote).next()
}

fn mistake(path: &Path, message: String) -> Mistakes {
    Mistakes(vec![Mistake { path: path.to_owned(), place: None, message, help: SAVE.into() }])
}

/// A file of a kind that is not read.
pub(crate) fn refused(path: &Path, name: &str, help: &str) -> Mistakes {
    let message = format!("this is {name}, which is not read");
    Mistakes(vec![Mistake { path: path.to_owned(), place: None, message, help: help.into() }])
}
