//! Zones in forms that authorities made for themselves: GeoJSON whose properties have names of their own. Each form is a row of
//! [`FORMS`]: how it is recognised, and where it says what.
//!
//! The shape and all that is said besides are read as for the standards, see [`crate::zones`].

use serde_json::{Map, Value};

use crate::applicability;
use crate::content::{Doubt, Height, Lost, Rule, Zone};
use crate::findings::{Findings, Wrong};
use crate::json::{Node, short};
use crate::limits::{self, End};
use crate::zone_text::in_words;
use crate::zones::{self, Doubts, RULES};

/// A form of publication.
#[derive(Debug)]
pub(crate) struct Form {
    /// The properties that its features have and those of no other form, with a value or without.
    marks: &'static [&'static str],
    rule: RuleBy,
    /// The first of these that is there.
    name: &'static [&'static str],
    lower: Option<Limit>,
    upper: Option<Limit>,
    /// The fields of a period: their names here, and those of ED-269.
    period: &'static [(&'static str, &'static str)],
    /// What humans should know.
    remarks: &'static [&'static str],
    /// Fields beginning with these limit no flight.
    unused: &'static [&'static str],
}

/// Where a form says what its zones restrict.
#[derive(Debug)]
enum RuleBy {
    /// A field with one of these words.
    Word(&'static str, &'static [(&'static str, Option<Rule>)]),
    /// The upper limit is how high a permission can be had: above it, or where it is 0, nobody flies.
    Ceiling,
}

#[derive(Debug)]
struct Limit {
    value: &'static str,
    unit: Text,
    reference: Text,
}

#[derive(Debug)]
enum Text {
    In(&'static str),
    Is(&'static str),
}

const FORMS: [Form; 5] = [
    // Germany, dipul: one layer for each kind of place.
    Form {
        marks: &["type_code", "legal_ref"],
        rule: RuleBy::Word("type_code", &GERMAN),
        name: &["name", "external_reference"],
        lower: Some(Limit {
            value: "lower_limit_altitude",
            unit: Text::In("lower_limit_unit"),
            reference: Text::In("lower_limit_alt_ref"),
        }),
        upper: Some(Limit {
            value: "upper_limit_altitude",
            unit: Text::In("upper_limit_unit"),
            reference: Text::In("upper_limit_alt_ref"),
        }),
        period: &[("start_time", "startDateTime"), ("end_time", "endDateTime")],
        remarks: &["type_code", "type_code_detail", "legal_ref", "external_reference"],
        unused: &["generated_name"],
    },
    // Belgium, the map of DroneGuide: all heights are above the ground.
    Form {
        marks: &["lower_limit_altitude_meter_agl", "upper_limit_altitude_meter_agl"],
        rule: RuleBy::Word("restriction", &RULES),
        name: &["code", "unique_identifier"],
        lower: Some(Limit { value: "lower_limit_altitude_meter_agl", unit: Text::Is("M"), reference: Text::Is("AGL") }),
        upper: Some(Limit { value: "upper_limit_altitude_meter_agl", unit: Text::Is("M"), reference: Text::Is("AGL") }),
        period: &[],
        remarks: &["name", "type_code", "restriction", "description", "external_reference"],
        unused: &["original_geometry", "unique_identifier"],
    },
    // Denmark: a colour for each kind, and no heights.
    Form {
        marks: &["Farve", "typeId"],
        rule: RuleBy::Word("Farve", &DANISH),
        name: &["title", "ICAO"],
        lower: None,
        upper: None,
        period: &[],
        remarks: &["typeId", "ICAO", "Bufferzone", "Kommentar"],
        unused: &["OBJECTID", "Shape", "Elevation"],
    },
    // Switzerland, the layer of the federal map.
    Form {
        marks: &["zone_restriction_id", "air_vol_lower_limit"],
        rule: RuleBy::Word("zone_restriction_id", &RULES),
        name: &["zone_id", "zone_name_en", "zone_name_de"],
        lower: Some(Limit {
            value: "air_vol_lower_limit",
            unit: Text::Is("M"),
            reference: Text::In("air_vol_lower_vref"),
        }),
        upper: Some(Limit {
            value: "air_vol_upper_limit",
            unit: Text::Is("M"),
            reference: Text::In("air_vol_upper_vref"),
        }),
        period: &[
            ("time_permanent", "permanent"),
            ("time_start", "startDateTime"),
            ("time_end", "endDateTime"),
            ("period_day", "day"),
            ("period_start", "startTime"),
            ("period_end", "endTime"),
        ],
        remarks: &["zone_name_en", "zone_restriction_en", "zone_message_en", "auth_name_en"],
        unused: &["zone_", "auth_", "label"],
    },
    // United States, UAS Facility Map: cells of a grid.
    Form {
        marks: &["CEILING", "UNIT"],
        rule: RuleBy::Ceiling,
        name: &["APT1_ICAO", "APT1_FAAID", "APT1_NAME"],
        lower: None,
        upper: Some(Limit { value: "CEILING", unit: Text::In("UNIT"), reference: Text::Is("AGL") }),
        period: &[],
        remarks: &["APT1_NAME", "APT1_LAANC", "AIRSPACE_1", "MAP_EFF", "LAST_EDIT"],
        unused: &[
            "APT",
            "AIRS",
            "ARPT",
            "OBJECTID",
            "GLOBALID",
            "GlobalID",
            "LATITUDE",
            "LONGITUDE",
            "REGION",
            "Shape",
        ],
    },
];

/// What LuftVO 21h (3) allows with the consent of the one who runs the place, or of an authority, is flown with a permission. The others
/// are closed: restricted areas, and temporary restrictions.
const GERMAN: [(&str, Option<Rule>); 32] = [
    ("FLUGBESCHRAENKUNGSGEBIET", Some(Rule::KeepOut)),
    ("TEMPORAERE_BETRIEBSEINSCHRAENKUNG", Some(Rule::KeepOut)),
    ("U_NFZ", Some(Rule::KeepOut)),
    ("FLUGHAFEN", Some(Rule::Permission)),
    ("FLUGPLATZ", Some(Rule::Permission)),
    ("KONTROLLZONE", Some(Rule::Permission)),
    ("MILITAERISCHE_ANLAGE", Some(Rule::Permission)),
    ("JUSTIZVOLLZUGSANSTALT", Some(Rule::Permission)),
    ("KRANKENHAUS", Some(Rule::Permission)),
    ("POLIZEI", Some(Rule::Permission)),
    ("SICHERHEITSBEHOERDE", Some(Rule::Permission)),
    ("BEHOERDE", Some(Rule::Permission)),
    ("DIPLOMATISCHE_VERTRETUNG", Some(Rule::Permission)),
    ("INTERNATIONALE_ORGANISATION", Some(Rule::Permission)),
    ("INDUSTRIEANLAGE", Some(Rule::Permission)),
    ("KRAFTWERK", Some(Rule::Permission)),
    ("UMSPANNWERK", Some(Rule::Permission)),
    ("LABOR", Some(Rule::Permission)),
    ("WOHNGRUNDSTUECK", Some(Rule::Permission)),
    ("FREIBAD", Some(Rule::Permission)),
    ("NATIONALPARK", Some(Rule::Permission)),
    ("NATURSCHUTZGEBIET", Some(Rule::Permission)),
    ("FFH-GEBIET", Some(Rule::Permission)),
    ("VOGELSCHUTZGEBIET", Some(Rule::Permission)),
    ("BUNDESAUTOBAHN", Some(Rule::Permission)),
    ("BUNDESSTRASSE", Some(Rule::Permission)),
    ("BAHNANLAGE", Some(Rule::Permission)),
    ("BINNENWASSERSTRASSE", Some(Rule::Permission)),
    ("SEEWASSERSTRASSE", Some(Rule::Permission)),
    ("SCHIFFFAHRTSANLAGE", Some(Rule::Permission)),
    ("STROMLEITUNG", Some(Rule::Permission)),
    ("WINDKRAFTANLAGE", Some(Rule::Permission)),
];
/// Critical for aviation; attention; critical for security. Flights need a permission, or the attention of a human.
const DANISH: [(&str, Option<Rule>); 3] =
    [("1", Some(Rule::Permission)), ("4", Some(Rule::Permission)), ("5", Some(Rule::Permission))];

/// The form of a feature, if it is one of these.
pub(crate) fn form(item: &Node<'_>) -> Option<&'static Form> {
    let properties = item.value.get("properties")?.as_object()?;
    FORMS.iter().find(|form| form.marks.iter().all(|it| properties.contains_key(*it)))
}

/// The zones of a feature.
pub(crate) fn read(form: &Form, item: &Node<'_>, index: usize, findings: &mut Findings) -> Result<Vec<Zone>, Lost> {
    zones(form, item, index, findings).map_err(|wrong| zones::lost(item, wrong))
}

fn zones(form: &Form, item: &Node<'_>, index: usize, findings: &mut Findings) -> Result<Vec<Zone>, Wrong> {
    let mut doubts = Doubts::default();
    let properties = item.need("properties")?;
    form.note_unknown(&properties, findings);
    let name = properties.any_of(form.name).map_or_else(|| format!("zone {index}"), |it| in_words(it.value));
    let rule = match form.rule {
        RuleBy::Ceiling => Some(Rule::Permission),
        RuleBy::Word(field, words) => doubts.or(word(&properties, field, words), Some(Rule::KeepOut)),
    };
    let Some(rule) = rule else {
        findings.note(&item.place, "a zone without restriction: left out");
        return Ok(Vec::new());
    };
    let mut remarks: Vec<String> =
        form.remarks.iter().filter_map(|it| Some(format!("{it}: {}", in_words(properties.get(it)?.value)))).collect();
    let mut shapes = Vec::new();
    let geometry = item.need("geometry")?;
    zones::parts(&geometry, None, findings, &mut shapes)?;
    if shapes.is_empty() {
        return Err(geometry.wrong("at least one shape"));
    }
    let period = form.period(&properties);
    let period = period.as_ref().map(|value| Node { value, place: properties.place.clone() });
    let within = shapes.iter().map(|it| &it.outline);
    let periods = applicability::periods(period, within, &mut remarks, &mut doubts, findings);
    let lower = doubts.or(limit(form.lower.as_ref(), End::Lower, &properties), None);
    let upper = limit(form.upper.as_ref(), End::Upper, &properties);
    let upper = doubts.or(upper, None);
    let has_ceiling = matches!(form.rule, RuleBy::Ceiling);
    if has_ceiling && upper.is_none() && doubts.0.is_empty() {
        doubts.0.push(Doubt { place: properties.place.clone(), message: "its ceiling is missing".into() });
    }
    let zone = |shape: zones::Shape<'_>| Zone {
        lower,
        upper,
        periods: periods.clone(),
        remarks: remarks.clone(),
        doubts: doubts.0.clone(),
        ..Zone::always(name.clone(), rule, shape.outline, shape.place)
    };
    let zones = shapes.into_iter().map(zone);
    Ok(if has_ceiling { zones.flat_map(below_and_above).collect() } else { zones.collect() })
}

/// A permission up to the ceiling, and nothing above it; where it is at the ground or not known, nothing at all.
fn below_and_above(zone: Zone) -> Vec<Zone> {
    let Some(ceiling) = zone.upper.filter(|it| 0.0 < it.metres) else {
        return vec![Zone { rule: Rule::KeepOut, upper: None, ..zone }];
    };
    let above = Zone {
        name: format!("{} above", zone.name),
        rule: Rule::KeepOut,
        lower: Some(ceiling),
        upper: None,
        ..zone.clone()
    };
    vec![zone, above]
}

/// What a word means, which may be published as a number.
fn word(properties: &Node<'_>, field: &str, words: &[(&str, Option<Rule>)]) -> Result<Option<Rule>, Wrong> {
    let found = properties.need(field)?;
    let text = in_words(found.value);
    let known = words.iter().find(|(word, _)| word.eq_ignore_ascii_case(text.trim()));
    known.map(|(_, rule)| *rule).ok_or_else(|| {
        Wrong::at(
            &found.place,
            format!("`{}` is not a known {field}", short(&text)),
            "leave the zone out if it limits no flight",
        )
    })
}

fn limit(limit: Option<&Limit>, end: End, properties: &Node<'_>) -> Result<Option<Height>, Wrong> {
    let Some(Limit { value, unit, reference }) = limit else { return Ok(None) };
    let Some(value) = properties.get(value) else { return Ok(None) };
    let fixed = [unit, reference].map(|text| match text {
        Text::Is(word) => Value::from(*word),
        Text::In(_) => Value::Null,
    });
    let [unit, reference] = [unit.node(&fixed[0], properties), reference.node(&fixed[1], properties)];
    limits::height(end, &value, unit.as_ref(), reference.as_ref())
}

impl Text {
    fn node<'a>(&self, fixed: &'a Value, properties: &Node<'a>) -> Option<Node<'a>> {
        match self {
            Text::In(field) => properties.get(field),
            Text::Is(_) => Some(Node { value: fixed, place: properties.place.clone() }),
        }
    }
}

impl Form {
    /// Its period in the fields of ED-269.
    fn period(&self, properties: &Node<'_>) -> Option<Value> {
        let member =
            |(ours, standard): &(&str, &str)| Some(((*standard).to_owned(), properties.get(ours)?.value.clone()));
        let members: Map<String, Value> = self.period.iter().filter_map(member).collect();
        (!members.is_empty()).then_some(Value::Object(members))
    }

    fn note_unknown(&self, properties: &Node<'_>, findings: &mut Findings) {
        let mut read: Vec<&str> = [self.marks, self.name, self.remarks].concat();
        read.extend(self.period.iter().map(|(ours, _)| *ours));
        for limit in self.lower.iter().chain(&self.upper) {
            read.push(limit.value);
            read.extend([&limit.unit, &limit.reference].into_iter().filter_map(|it| match it {
                Text::In(field) => Some(*field),
                Text::Is(_) => None,
            }));
        }
        if let RuleBy::Word(field, _) = self.rule {
            read.push(field);
        }
        let fields = properties.value.as_object().into_iter().flat_map(|it| it.keys());
        for field in fields.filter(|it| !self.unused.iter().any(|unused| it.starts_with(unused))) {
            if !read.contains(&field.as_str()) {
                findings.note(&properties.place, format!("field `{}` is not in the format: not read", short(field)));
            }
        }
    }
}
