//! `kittiwake run router`: the router that every process of a side connects to, with one end of the link.

use bus::crossing::Crossing;
use bus::link_credentials;
use bus::router::{LinkEnd, News, Way};
use bus::{BusError, Stop, run_linked_router};
use domain::file::Source;

use crate::cli::RouterArgs;
use crate::outcome::Outcome;
use crate::run::end::stop_on_end;
use crate::run::watchdog::Watchdog;
use crate::{output, telemetry};

/// Runs the router; the first lines on standard output are the locators it listens on. Changes of the link are reported
/// on standard error.
pub fn router(args: &RouterArgs) -> Outcome {
    output::in_background();
    let link = match link_end(args) {
        Ok(link) => link,
        Err(bad) => {
            output::error_line(bad);
            return Outcome::BadInput;
        }
    };
    let telemetry = telemetry::start("router", "", &telemetry::Config { otlp_endpoint: None });
    let result = run(args, link.as_ref());
    telemetry.end();
    match result {
        Ok(()) => Outcome::Success,
        Err(cause) => {
            output::error_line(format_args!("router: {cause}"));
            Outcome::NotKeptUp
        }
    }
}

fn run(args: &RouterArgs, link: Option<&LinkEnd>) -> Result<(), String> {
    let stop = Stop::new();
    stop_on_end(&stop, args.exit_with_parent).map_err(|cause| format!("the operating system refuses: {cause}"))?;
    let mut watchdog = Watchdog::from_environment();
    let result = run_linked_router(&args.listen, link, &stop, |news| tell(news, &mut watchdog));
    result.map_err(|cause: BusError| cause.to_string())
}

fn tell(news: News, watchdog: &mut Watchdog) {
    match news {
        News::Turned => watchdog.turned(),
        News::Listening(bound) => bound.iter().for_each(output::line),
        News::Up { peer } => output::error_line(format_args!("router: the link to {peer} is up")),
        News::Crowded { peer, most, from } => output::error_line(format_args!(
            "router: {} connections under the name of {peer}, which makes {most} at most: another machine uses its certificate; they come from {}",
            from.len(),
            from.join(", ")
        )),
        News::Down { peer, since, .. } if since.is_zero() => {
            output::error_line(format_args!("router: the link to {peer} is down"));
        }
        News::Down { peer, since, why } => {
            let (seconds, why) = (since.as_secs(), why.map(|it| format!(": {it}")).unwrap_or_default());
            output::error_line(format_args!("router: the link to {peer} has been down for {seconds} s{why}"));
        }
    }
}

/// The end of the link that the arguments name; its table and credentials are checked.
fn link_end(args: &RouterArgs) -> Result<Option<LinkEnd>, String> {
    let vehicles: Vec<_> = args.vehicle.iter().map(ToString::to_string).collect();
    let way = match (&args.accept, &args.dial) {
        (Some(locator), None) => Way::Accept { locator: locator.clone(), vehicles },
        (None, Some(locator)) => match vehicles.as_slice() {
            [vehicle] => Way::Dial { locator: locator.clone(), vehicle: vehicle.clone() },
            _ => return Err("router: `--dial` is for one aircraft: give one --vehicle".into()),
        },
        _ => return Ok(None),
    };
    let (Way::Accept { locator, .. } | Way::Dial { locator, .. }) = &way;
    if !locator.starts_with("tls/") {
        return Err(format!("router: found `{locator}`, expected `tls/HOST:PORT`: the link is always encrypted"));
    }
    // The command line requires both together with the way.
    let (Some(table), Some(credentials)) = (&args.link, &args.certificates) else { return Ok(None) };
    let table = Source::read(table).and_then(|it| Crossing::read(&it)).map_err(|it| it.to_string())?;
    let link = LinkEnd { table, credentials: credentials.clone(), way };
    match link_credentials::check(&link.credentials, &link.name(), link.side()) {
        Ok(()) => Ok(Some(link)),
        Err(bad) if bad.refuses(link.side()) => Err(format!("router: {bad}")),
        // It is reported again while the link is down, which is taken up as soon as the files are good.
        Err(bad) => {
            let what = if bad.forbids_link() { "no link for now: " } else { "" };
            output::error_line(format_args!("router: {what}{bad}"));
            Ok(Some(link))
        }
    }
}
