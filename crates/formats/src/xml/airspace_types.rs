//! What a type of airspace in AIXM asks of a drone.

use crate::content::Rule;

/// Nobody enters.
const KEEP_OUT: [&str; 2] = ["P", "R"];
/// They name who serves or governs a region: by themselves they limit no flight. What does is published as airspace of its own.
const REGIONS: [&str; 12] =
    ["NAS", "NAS_P", "FIR", "FIR_P", "UIR", "UIR_P", "NO_FIR", "OCA", "OCA_P", "POLITICAL", "ASR", "AMA"];
/// All other types of the standard, AIXM 5.1 (CodeAirspaceType).
const ASKED: [&str; 31] = [
    "CTA", "CTA_P", "UTA", "UTA_P", "TMA", "TMA_P", "CTR", "CTR_P", "OTA", "SECTOR", "SECTOR_C", "TSA", "CBA", "RCA",
    "RAS", "AWY", "MTR", "D", "ADIZ", "PART", "CLASS", "D_OTHER", "TRA", "A", "W", "PROTECT", "ADV", "UADV", "ATZ",
    "ATZ_P", "HTZ",
];

/// `Ok(None)`: nothing. `Err`: the type is not known.
pub(super) fn rule(kind: Option<&str>) -> Result<Option<Rule>, String> {
    let Some(kind) = kind else { return Err("it has no `type`".into()) };
    let upper = kind.to_ascii_uppercase();
    match upper.as_str() {
        it if KEEP_OUT.contains(&it) => Ok(Some(Rule::KeepOut)),
        it if REGIONS.contains(&it) => Ok(None),
        // What a state adds: `OTHER:FRZ`.
        it if ASKED.contains(&it) || it == "OTHER" || it.starts_with("OTHER:") => Ok(Some(Rule::Permission)),
        _ => Err(format!("the type `{}` is not known", crate::json::short(kind))),
    }
}
