//! The operator's page: its files, built into the program, and the headers they are served with.
//!
//! The page is data to this crate. One content security policy restricts it in a browser: scripts, styles and
//! connections of its own origin, nothing inline and nothing from elsewhere.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::LazyLock;

use axum::extract::Path;
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::header::{REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};

use crate::http::problem::Problem;
use crate::http::routes::{Access, Reply, Route, Routes};

const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const IMAGE: &str = "image/svg+xml";

/// A file of the page.
#[derive(Debug)]
struct File {
    name: &'static str,
    media_type: &'static str,
    bytes: &'static [u8],
}

macro_rules! files {
    ($($name:literal: $media_type:expr),+ $(,)?) => {
        &[$(File { name: $name, media_type: $media_type, bytes: include_bytes!(concat!("../../page/", $name)) }),+]
    };
}

/// Every file; one that is not listed is not served.
static FILES: &[File] = files![
    "alarms.js": SCRIPT,
    "api.js": SCRIPT,
    "approval.js": SCRIPT,
    "command-authority.js": SCRIPT,
    "commands.css": STYLE,
    "commands.js": SCRIPT,
    "contingencies.js": SCRIPT,
    "docs.css": STYLE,
    "docs.html": HTML,
    "docs.js": SCRIPT,
    "dom.js": SCRIPT,
    "draft.js": SCRIPT,
    "editor.css": STYLE,
    "editor.js": SCRIPT,
    "feeds.js": SCRIPT,
    "fleet.js": SCRIPT,
    "forecast.js": SCRIPT,
    "gateway-clock.js": SCRIPT,
    "icon.svg": IMAGE,
    "index.html": HTML,
    "injection.js": SCRIPT,
    "insert.js": SCRIPT,
    "layout.js": SCRIPT,
    "legs.js": SCRIPT,
    "main.js": SCRIPT,
    "map-aircraft.js": SCRIPT,
    "map-draft.js": SCRIPT,
    "map-fleet.js": SCRIPT,
    "map-areas.js": SCRIPT,
    "map-ground.js": SCRIPT,
    "map-input.js": SCRIPT,
    "map-pen.js": SCRIPT,
    "map-route.js": SCRIPT,
    "map-sites.js": SCRIPT,
    "map-view.js": SCRIPT,
    "map.css": STYLE,
    "map.js": SCRIPT,
    "mission-text.js": SCRIPT,
    "mission.js": SCRIPT,
    "notices.js": SCRIPT,
    "objectives.js": SCRIPT,
    "orders.js": SCRIPT,
    "panels.css": STYLE,
    "permissions.js": SCRIPT,
    "plan-memory.js": SCRIPT,
    "plots.js": SCRIPT,
    "processes.js": SCRIPT,
    "recordings.js": SCRIPT,
    "response.js": SCRIPT,
    "shelf.js": SCRIPT,
    "small.css": STYLE,
    "staleness.js": SCRIPT,
    "store.js": SCRIPT,
    "strip.js": SCRIPT,
    "style.css": STYLE,
    "theme.css": STYLE,
    "timeline.js": SCRIPT,
    "top.js": SCRIPT,
    "tree.js": SCRIPT,
    "words.js": SCRIPT,
];

/// `/`, `/docs` and `/page/{file}`. None needs a token, since the page is the place to enter one.
pub(crate) fn add_to(routes: Routes) -> Routes {
    routes
        .add(Route::read("/", Access::Anyone, "The operator's page", Reply::Media("text/html")), index)
        .add(Route::read("/docs", Access::Anyone, "The OpenAPI document, to browse", Reply::Media("text/html")), docs)
        .add(Route::read("/page/{file}", Access::Anyone, "A file of the page", Reply::Media("*/*")), file)
}

async fn index(headers: HeaderMap) -> Response {
    serve("index.html", &headers)
}

async fn docs(headers: HeaderMap) -> Response {
    serve("docs.html", &headers)
}

async fn file(Path(name): Path<String>, headers: HeaderMap) -> Response {
    serve(&name, &headers)
}

/// A browser asks each time whether its copy is current, so that a page is never used with the API of another build.
fn serve(name: &str, request: &HeaderMap) -> Response {
    let Some(file) = FILES.iter().find(|file| file.name == name) else {
        return Problem::new(StatusCode::NOT_FOUND, format!("the page has no file `{name}`")).into_response();
    };
    let tag = file.tag();
    let headers = [
        (CONTENT_TYPE, file.media_type),
        (CONTENT_SECURITY_POLICY, POLICY),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (REFERRER_POLICY, "no-referrer"),
        (CACHE_CONTROL, "no-cache"),
        (ETAG, &tag),
    ];
    if request.get(IF_NONE_MATCH).is_some_and(|it| it.as_bytes() == tag.as_bytes()) {
        return (StatusCode::NOT_MODIFIED, headers).into_response();
    }
    (headers, file.bytes).into_response()
}

/// A hash of all files, by which a page that is open knows whether this gateway has the same one.
pub(crate) fn tag() -> String {
    static TAG: LazyLock<String> = LazyLock::new(|| hash(FILES.iter().map(|it| it.bytes)));
    TAG.clone()
}

impl File {
    /// A hash of the content, which differs when another build has other content. It takes a few microseconds.
    fn tag(&self) -> String {
        format!("\"{}\"", hash([self.bytes]))
    }
}

fn hash(parts: impl IntoIterator<Item = &'static [u8]>) -> String {
    let mut hasher = DefaultHasher::new();
    parts.into_iter().for_each(|it| it.hash(&mut hasher));
    format!("{:016x}", hasher.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(name: &str, request: &HeaderMap, status: StatusCode, media_type: &str) -> Response {
        let response = serve(name, request);
        assert_eq!(response.status(), status, "{name}");
        assert_eq!(response.headers()[CONTENT_TYPE], media_type, "{name}");
        response
    }

    #[test]
    fn every_file_is_served_with_its_type_and_the_policy() {
        for file in FILES {
            let response = check(file.name, &HeaderMap::new(), StatusCode::OK, file.media_type);
            assert_eq!(response.headers()[CONTENT_SECURITY_POLICY], POLICY);
        }
        check("secrets.toml", &HeaderMap::new(), StatusCode::NOT_FOUND, "application/problem+json");
        check("../Cargo.toml", &HeaderMap::new(), StatusCode::NOT_FOUND, "application/problem+json");
    }

    #[test]
    fn a_copy_that_is_current_is_not_sent_again() {
        let tag = check("main.js", &HeaderMap::new(), StatusCode::OK, SCRIPT).headers()[ETAG].clone();
        let request = HeaderMap::from_iter([(IF_NONE_MATCH, tag)]);
        check("main.js", &request, StatusCode::NOT_MODIFIED, SCRIPT);
        check("store.js", &request, StatusCode::OK, SCRIPT);
    }

    /// The policy forbids both, and a browser would report it on its console only.
    #[test]
    fn nothing_is_inline_and_nothing_comes_from_elsewhere() {
        for file in FILES {
            let text = String::from_utf8_lossy(file.bytes).replace("http://www.w3.org/2000/svg", "");
            for forbidden in ["http://", "https://", "<style", "style=\"", "<script>", "onclick=", "eval("] {
                assert!(!text.contains(forbidden), "{} has {forbidden}", file.name);
            }
        }
    }

    /// A browser shows an empty page if one export is missing.
    #[test]
    fn every_import_names_what_a_file_of_the_page_exports() {
        for file in FILES {
            let text = String::from_utf8_lossy(file.bytes);
            for (names, from) in text.split("import {").skip(1).filter_map(|it| it.split_once("} from \"./")) {
                let from = from.split('"').next().unwrap_or_default();
                let exporter = FILES.iter().find(|it| it.name == from);
                let exporter = exporter.unwrap_or_else(|| panic!("{} imports {from}", file.name));
                let exports = String::from_utf8_lossy(exporter.bytes);
                for name in names.split(',').map(str::trim).filter(|it| !it.is_empty()) {
                    let is_exported = ["function", "async function", "const", "class"]
                        .iter()
                        .any(|kind| exports.split(&format!("export {kind} {name}")).skip(1).any(ends_a_word));
                    assert!(is_exported, "{} imports {name} from {from}", file.name);
                }
            }
        }
    }

    fn ends_a_word(rest: &str) -> bool {
        !rest.starts_with(|it: char| it.is_alphanumeric() || it == '_')
    }
}
