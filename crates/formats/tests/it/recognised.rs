//! The content of a file says which format it has, and a format that is not read is refused by its name.

use std::io::{Cursor, Write as _};

use super::samples::{ED_269, KML};
use super::{areas, check_refused, settings};
use zip::CompressionMethod;
use zip::write::SimpleFileOptions;

/// An archive of these files.
pub(super) fn zip(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, bytes) in files {
        zip.start_file(*name, options).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

fn utf_16(text: &str) -> Vec<u8> {
    text.encode_utf16().flat_map(u16::to_le_bytes).collect()
}

#[test]
fn a_file_that_is_no_text_is_refused_by_its_name() {
    let check = check_refused;
    check(b"", "areas: the file is empty");
    check(b" \n\t", "the file is empty");
    check(
        &[b"\xff\xfe".as_slice(), &utf_16(KML)].concat(),
        "this is a text in UTF-16, which is not read\n  help: save it as UTF-8",
    );
    check(&utf_16(KML), "a text in UTF-16");
    check(&utf_16(ED_269), "a text in UTF-16");
    check(b"\xff\xfe\0\0<\0\0\0", "a text in UTF-32");
    check(b"\0\0\x27\x0a\0\0\0\0", "a shapefile");
    check(b"%PDF-1.7", "a PDF");
    check(b"\x1f\x8b\x08\0", "packed by gzip");
    check(b"SQLite format 3\0", "a GeoPackage");
    check(b"\x89PNG\r\n", "a picture (PNG)");
    check(b"\xff\xd8\xff\xe0", "a picture (JPEG)");
    check(b"GRIB\0\0\0\x02", "a weather forecast (GRIB)");
    check(b"some\0thing", "a binary file of an unknown kind");
    check(b"\xc3\xa9\xe9", "line 1 column 3: the byte 0xe9 is not UTF-8\n  help: save it as UTF-8");
    check(b"{\n\"a\": \"\xe9\"}", "line 2 column 7: the byte 0xe9 is not UTF-8");
}

#[test]
fn a_text_in_another_format_is_refused_by_its_name() {
    #[track_caller]
    fn check(text: &str, expected: &str) {
        check_refused(text.as_bytes(), expected);
    }
    check("<!DOCTYPE html><p>no", "a web page (HTML)");
    check("<!-- saved -->\n<html lang=en><p>no", "a web page (HTML)");
    check("<gpx><wpt lat='54' lon='6'/></gpx>", "this is GPX, which is not read");
    check("<svg/>", "a drawing (SVG)");
    check("<ows:ExceptionReport xmlns:ows='http://www.opengis.net/ows'/>", "an error report of a map server (WFS)");
    check("<wfs:FeatureCollection xmlns:wfs='http://www.opengis.net/wfs/2.0'/>", "this is GML");
    check("<AIXM-Snapshot/>", "AIXM 4.5");
    check("<airspaces/>", "XML with the root element `airspaces`");
    check("<kml><name>&eacute;</name></kml>", "line 1 column 12: the entity `&eacute;` is not known");
    check("<!DOCTYPE kml [<!ENTITY x SYSTEM 'file:///etc/passwd'>]><kml>&x;</kml>", "a document type definition");
    check("<?xml version='1.0' encoding='EBCDIC-X'?><kml/>", "in the encoding `EBCDIC-X`, which is not read");
    check("name,latitude,longitude\nA,54,6\n", "a table (CSV)");
    check("name;latitude\nA;54\n", "a table (CSV)");
    check("---\nzones:\n", "a file in YAML");
    check("zones:\n  - name: a\n", "a file in YAML");
    check("title = \"x\"\n", "a file in TOML");
    check("# a mission\nname = \"m\"\n[[objective]]\nname = \"a\"\n", "a mission file of Kittiwake");
    check("POLYGON ((6 54, 7 54, 7 55))", "a geometry in WKT");
    check("Dear all,\nsee attachment\n", "this text is in none of the formats");
    check("{\"type\": \"Topology\", \"objects\": {}}", "this is TopoJSON");
    check("{\"geometryType\": \"esriGeometryPolygon\", \"features\": [{\"attributes\": {}}]}", "this is Esri JSON");
    check("[{\"id\": \"document\", \"version\": \"1.0\"}]", "this is CZML");
    check("{\"type\": \"Feature\"}\n{\"type\": \"Feature\"}\n", "several JSON texts, one in each line");
    check("\u{1e}{\"type\": \"Feature\"}\n", "a sequence of JSON texts");
    check("[1, 2]", "/0: found 1, expected an object");
    check("{\"a\": 1} x", "line 1 column 10");
}

#[test]
fn an_archive_is_read_or_named() {
    let check = check_refused;
    check(&zip(&[("a.shp", b"x"), ("a.dbf", b"x")]), "a ZIP archive with a shapefile");
    check(&zip(&[("[Content_Types].xml", b"x")]), "an Office document");
    check(
        &zip(&[("feed/zones.json", b"{}")]),
        "a ZIP archive with `feed/zones.json`, which is not read\n  help: unpack it",
    );
    check(&zip(&[("readme", b"x")]), "a ZIP archive without KML");
    check(&zip(&[("doc.kml", KML.as_bytes()), ("more.kmz", b"x")]), "a ZIP archive with `more.kmz`");
    check(&zip(&[]), "an empty ZIP archive");
    check(b"PK\x03\x04 and no more", "a ZIP archive that cannot be unpacked");
    check(&zip(&[("doc.kml", b"<gpx/>")]), "areas/doc.kml: this is XML with the root element `gpx`");
    check(&zip(&[("doc.kml", b"PK\x03\x04")]), "areas/doc.kml: this is a ZIP archive");
    // A bomb: a megabyte of spaces takes a kilobyte.
    let bomb = zip(&[("doc.kml", &vec![b' '; 8 << 20])]);
    assert!(bomb.len() < 10_000);
    check(&bomb, "`doc.kml` in it cannot be unpacked: its KML has more than 1 MiB, at most 200 times of the archive");
    // In the local header and in the directory.
    let mut encrypted = zip(&[("doc.kml", KML.as_bytes())]);
    let directory = encrypted.windows(4).position(|it| it == b"PK\x01\x02").unwrap();
    encrypted[6] |= 1;
    encrypted[directory + 8] |= 1;
    check(&encrypted, "`doc.kml` in it cannot be unpacked: it is encrypted");
    // The size that it declares is not believed: four bytes in each header.
    let mut liar = zip(&[("doc.kml", &vec![b' '; 8 << 20])]);
    let directory = liar.windows(4).position(|it| it == b"PK\x01\x02").unwrap();
    liar[22..26].copy_from_slice(&100_u32.to_le_bytes());
    liar[directory + 24..directory + 28].copy_from_slice(&100_u32.to_le_bytes());
    check(&liar, "`doc.kml` in it cannot be unpacked");
}

#[test]
fn all_kml_of_an_archive_is_read_and_a_link_inside_is_followed() {
    let link = "<kml><NetworkLink><Link><href>files/b.kml</href></Link></NetworkLink></kml>";
    let archive = zip(&[("files/b.kml", KML.as_bytes()), ("doc.kml", link.as_bytes()), ("files/icon.png", b"\x89PNG")]);
    let (found, notes) = areas(&archive, &settings()).unwrap();
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(notes.contains("files/b.kml: line 4 column 5: a placemark without `kind`"), "{notes}");
    let alone = areas(&zip(&[("DOC.KML", KML.as_bytes())]), &settings()).unwrap();
    assert_eq!(alone, areas(KML.as_bytes(), &settings()).unwrap());
    check_refused(link.as_bytes(), "line 1 column 6: a NetworkLink: its places are in another file, `files/b.kml`");
}

#[test]
fn declared_encodings_are_read() {
    #[track_caller]
    fn check(encoding: &str, name: &[u8], expected: &str) {
        let ring = "6.606,54.004 6.609,54.004 6.609,54.006 6.606,54.004";
        let head = format!("<?xml version=\"1.0\" encoding=\"{encoding}\"?><kml><Placemark><name>");
        let tail = format!(
            "</name><Polygon><outerBoundaryIs><LinearRing><coordinates>{ring}</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></kml>"
        );
        let (found, _) = areas(&[head.as_bytes(), name, tail.as_bytes()].concat(), &settings()).unwrap();
        assert!(found[0].starts_with(&format!("{expected}: keep-out")), "{found:?}");
    }
    check("UTF-8", "Kräne".as_bytes(), "Kräne");
    check("utf-8", "Kräne".as_bytes(), "Kräne");
    check("ISO-8859-1", b"Kr\xe4ne", "Kräne");
    check("iso-8859-2", b"D\xbcwig", "Dźwig");
    check("windows-1250", b"D\x9fwig", "Dźwig");
    check("windows-1252", b"Kr\xe4ne", "Kräne");
    check("US-ASCII", b"Krane", "Krane");
    // Some programs declare the encoding of their memory.
    check("utf-16", "Kräne".as_bytes(), "Kräne");
}
