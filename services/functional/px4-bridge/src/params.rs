//! PX4's parameters against ours: whether Kittiwake reacts first and PX4 is the net below.
//!
//! Over Zenoh parameters cannot be read. They come from a file: what QGroundControl saves (Tools, Save to file), or what PX4 prints
//! for `param show`.

use std::collections::BTreeMap;
use std::fmt;

/// The parameters of a file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Params(BTreeMap<String, f64>);

/// Our side of the comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ours {
    /// The bridge's domain.
    pub domain: u8,
    /// The highest speed that deadlines are made with.
    pub speed_m_s: f64,
    /// The period of setpoints, in seconds.
    pub setpoint_period_s: f64,
}

/// How a parameter stands to what is ours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// PX4 is the net below ours.
    Fine,
    /// The file does not say.
    Unknown,
    /// The wrong way round.
    Wrong,
}

/// What is to be said of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// How it stands.
    pub level: Level,
    /// The parameter.
    pub name: &'static str,
    /// Its value, if the file has it.
    pub value: Option<f64>,
    /// What is expected, and why.
    pub expected: &'static str,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = match self.level {
            Level::Fine => "ok",
            Level::Unknown => "not in the file",
            Level::Wrong => "WRONG",
        };
        match self.value {
            Some(value) => write!(f, "{word}: {} = {value}; expected {}", self.name, self.expected),
            None => write!(f, "{word}: {}; expected {}", self.name, self.expected),
        }
    }
}

impl Params {
    /// Reads the lines that name a parameter and a number; others are passed over.
    pub fn parse(text: &str) -> Params {
        Params(text.lines().filter_map(pair).collect())
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

fn pair(line: &str) -> Option<(String, f64)> {
    let line = line.trim();
    if line.starts_with('#') {
        return None;
    }
    let mut words = line.split([' ', '\t', ',']).filter(|it| !it.is_empty());
    let is_name = |it: &&str| {
        it.len() > 2
            && it.starts_with(|c: char| c.is_ascii_uppercase())
            && it.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
    };
    let name = words.find(is_name)?;
    // `param show` writes the value after a colon, behind two numbers of its own.
    let value = match line.rsplit_once(" : ") {
        Some((_, value)) => value.trim().parse().ok()?,
        None => words.next()?.parse().ok()?,
    };
    Some((name.to_owned(), value))
}

/// A parameter, what suits, and why.
struct Rule {
    name: &'static str,
    suits: fn(f64, &Params, &Ours) -> bool,
    expected: &'static str,
}

/// Bit 2 of the exceptions: offboard.
const EXCEPT_OFFBOARD: u32 = 1 << 2;

/// The table of docs/px4.md.
const RULES: &[Rule] = &[
    Rule { name: "ZENOH_ENABLE", suits: |it, _, _| it == 1.0, expected: "1: otherwise PX4 does not call" },
    Rule {
        name: "ZENOH_DOMAIN_ID",
        suits: |it, _, ours| it == f64::from(ours.domain),
        expected: "the domain of [px4_bridge]",
    },
    Rule {
        name: "COM_OF_LOSS_T",
        suits: |it, _, ours| 5.0 * ours.setpoint_period_s <= it && it <= 2.0,
        expected: "five periods of setpoints up to 2 s: shorter and a busy machine loses offboard, longer and a dead one flies on",
    },
    Rule {
        name: "COM_OBL_RC_ACT",
        suits: |it, _, _| [4.0, 5.0].contains(&it),
        expected: "5 (Hold) or 4 (Land): a return leads straight through areas that nobody has granted",
    },
    Rule {
        name: "NAV_DLL_ACT",
        suits: |it, all, _| it == 0.0 || excepts(all, "COM_DLL_EXCEPT"),
        expected: "0, or COM_DLL_EXCEPT with bit 2 (offboard): Kittiwake is not a ground station for PX4 and has its own link",
    },
    Rule {
        name: "NAV_RCL_ACT",
        suits: |it, all, _| it == 0.0 || excepts(all, "COM_RCL_EXCEPT"),
        expected: "COM_RCL_EXCEPT with bit 2 (offboard), or 0: without that a lost remote control ends a mission",
    },
    Rule {
        name: "COM_LOW_BAT_ACT",
        suits: |it, _, _| [2.0, 3.0].contains(&it),
        expected: "3 (return, then land) or 2 (land): with 0 PX4 only warns",
    },
    Rule {
        name: "BAT_CRIT_THR",
        suits: |it, _, _| it < 0.10,
        expected: "less than 0.10, where Kittiwake lands (`battery_critical`)",
    },
    Rule {
        name: "BAT_EMERGEN_THR",
        suits: |it, _, _| it <= 0.05,
        expected: "0.05 or less, where Kittiwake comes down at once (`battery_emergency`)",
    },
    Rule {
        name: "GF_ACTION",
        suits: |it, _, _| [0.0, 1.0, 2.0].contains(&it),
        expected: "2 (Hold), 1 or 0: a return or a landing at the fence is harder than what Kittiwake does",
    },
    Rule {
        name: "COM_FLT_TIME_MAX",
        suits: |it, _, _| it <= 0.0 || 600.0 <= it,
        expected: "-1 (off), or longer than every mission: it returns and cannot be taken back",
    },
    Rule {
        name: "COM_DISARM_LAND",
        suits: |it, _, _| it <= 0.0 || 1.0 <= it,
        expected: "1 s or more, so that a bounce does not disarm",
    },
    Rule {
        name: "COM_DISARM_PRFLT",
        suits: |it, _, _| it <= 0.0 || 5.0 <= it,
        expected: "5 s or more: a takeoff may take 5 s to begin",
    },
    Rule {
        name: "MPC_XY_VEL_MAX",
        suits: |it, _, ours| ours.speed_m_s <= it,
        expected: "at least `vehicle_speed_m_s` of [skill_manager]: deadlines are made with that",
    },
    Rule {
        name: "PLD_BTOUT",
        suits: |it, _, _| 4.0 <= it,
        expected: "4 s or more: `landing_target_lost` answers 3 s after a target is lost; PX4 then searches by itself",
    },
];

fn excepts(all: &Params, name: &str) -> bool {
    all.0.get(name).is_some_and(|it| *it as u32 & EXCEPT_OFFBOARD != 0)
}

/// What is to be said of each parameter of the table.
pub fn check(params: &Params, ours: &Ours) -> Vec<Finding> {
    let finding = |Rule { name, suits, expected }: &Rule| {
        let value = params.0.get(*name).copied();
        let level = match value {
            None => Level::Unknown,
            Some(it) if suits(it, params, ours) => Level::Fine,
            Some(_) => Level::Wrong,
        };
        Finding { level, name, value, expected }
    };
    RULES.iter().map(finding).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const OURS: Ours = Ours { domain: 0, speed_m_s: 12.0, setpoint_period_s: 0.05 };

    #[test]
    fn parameters_are_read_as_qgroundcontrol_and_px4_write_them() {
        let text = "# Onboard parameters\n1\t1\tCOM_OF_LOSS_T\t1.000000\t9\nx + NAV_DLL_ACT [230,410] : 2\nGF_ACTION,2\nnothing here\n";
        let params = Params::parse(text);
        let expected = [("COM_OF_LOSS_T", 1.0), ("NAV_DLL_ACT", 2.0), ("GF_ACTION", 2.0)];
        assert_eq!(params, Params(expected.into_iter().map(|(name, it)| (name.to_owned(), it)).collect()));
    }

    #[test]
    fn the_wrong_way_round_is_said() {
        #[track_caller]
        fn check_one(text: &str, name: &str, level: Level) {
            let found = check(&Params::parse(text), &OURS).into_iter().find(|it| it.name == name);
            assert_eq!(found.map(|it| it.level), Some(level), "{text}");
        }
        check_one("", "COM_OBL_RC_ACT", Level::Unknown);
        check_one("COM_OBL_RC_ACT 0", "COM_OBL_RC_ACT", Level::Wrong);
        check_one("COM_OBL_RC_ACT 5", "COM_OBL_RC_ACT", Level::Fine);
        check_one("COM_OF_LOSS_T 0.2", "COM_OF_LOSS_T", Level::Wrong);
        check_one("COM_OF_LOSS_T 1.0", "COM_OF_LOSS_T", Level::Fine);
        check_one("NAV_DLL_ACT 2", "NAV_DLL_ACT", Level::Wrong);
        check_one("NAV_DLL_ACT 2\nCOM_DLL_EXCEPT 4", "NAV_DLL_ACT", Level::Fine);
        check_one("NAV_RCL_ACT 2\nCOM_RCL_EXCEPT 3", "NAV_RCL_ACT", Level::Wrong);
        check_one("BAT_CRIT_THR 0.15", "BAT_CRIT_THR", Level::Wrong);
        check_one("BAT_CRIT_THR 0.07", "BAT_CRIT_THR", Level::Fine);
        check_one("MPC_XY_VEL_MAX 8", "MPC_XY_VEL_MAX", Level::Wrong);
        check_one("ZENOH_DOMAIN_ID 1", "ZENOH_DOMAIN_ID", Level::Wrong);
    }
}
