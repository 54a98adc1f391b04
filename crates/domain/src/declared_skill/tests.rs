use super::*;
use crate::testing::check_mistake;

const GOOD: &str = r#"
version = 1
summary = "Lowers a load on a rope"
precondition = "vehicle.flying and position.height_m < 40 m"
invariant = "motion.ground_speed_m_s < 2 m/s"
seconds = "2 + 2 * length_m"
power_w = 40.0
limit_s = 60.0
interrupt_s = 5.0
[input.length_m]
least = 1.0
most = 20.0
[outcome]
done = "success"
snagged = "failure"
[mavlink]
command = "DO_WINCH"
params = [1, "length_m"]
"#;

fn read(text: &str) -> Result<DeclaredSkill, Mistakes> {
    DeclaredSkill::read(&Source { path: "winch_down.toml".into(), text: text.into() })
}

#[test]
fn a_declaration_says_what_a_task_takes() {
    let skill = read(GOOD).unwrap();
    let task = Task { skill: "winch_down".into(), inputs: vec![("length_m".into(), 12.0.into())] };
    let goal = skill.goal(&task, Ned::default());
    assert_eq!((goal.estimate_s, goal.limit_s, goal.interrupt_s, skill.tries), (26.0, 60.0, 5.0, 1));
    assert_eq!(goal.task.to_string(), "winch_down (length_m 12)");
    assert_eq!(skill.outcomes().collect::<Vec<_>>(), [("done", true), ("snagged", false)]);
}

#[test]
fn a_task_that_no_declaration_allows_is_told() {
    #[track_caller]
    fn check(skill: &str, inputs: &[(&str, f64)], expected: Option<&str>) {
        let inputs = inputs.iter().map(|(name, value)| ((*name).to_owned(), Value::Number(*value))).collect();
        let declared = DeclaredSkills::of(vec![read(GOOD).unwrap()]);
        let found = declared.misfit(&Task { skill: skill.into(), inputs }, Stance::Hovers, 10.0);
        assert_eq!(found.map(|(message, _)| message).as_deref(), expected);
    }
    check("winch_down", &[("length_m", 12.0)], None);
    check("winch_up", &[], Some("there is no declared skill `winch_up`"));
    check("winch_down", &[], Some("skill `winch_down` needs `length_m`"));
    check("winch_down", &[("length_m", 50.0)], Some("`length_m` of skill `winch_down` is 50, expected from 1 to 20"));
    check("winch_down", &[("lenght_m", 5.0)], Some("skill `winch_down` has no input `lenght_m`"));
}

#[test]
fn a_task_is_done_as_near_to_the_height_of_its_objective_as_its_conditions_allow() {
    #[track_caller]
    fn check(condition: &str, height_m: f64, expected_m: f64) {
        let skill = read(&GOOD.replace("position.height_m < 40 m", condition)).unwrap_or_else(|it| panic!("{it}"));
        let task = skill.example(&[]);
        let skills = DeclaredSkills::of(vec![skill]);
        assert_eq!(skills.height_m(&task, Stance::Hovers, height_m), Some(expected_m), "{condition} at {height_m} m");
    }
    let band = "position.height_m >= 2.5 m and position.height_m <= 3.5 m";
    check(band, 30.0, 3.0);
    check(band, 1.0, 3.0);
    // At its bounds a vehicle would leave it.
    check(band, 2.5, 3.0);
    check("position.height_m < 40 m", 39.4, 39.4);
    check("position.height_m < 40 m", 39.6, 38.0);
    check("position.height_m <= 40 m", 60.0, 39.0);
    check("position.height_m > 20 m", 15.0, 22.0);
    check("(position.height_m < 6 m or position.height_m > 14 m)", 9.0, 4.0);
    // What is not known beforehand is judged in flight.
    check("position.distance_home_m < 5 m and battery.charge_percent < 50 %", 9.0, 9.0);
}

#[test]
fn two_skills_of_one_payload_are_told() {
    #[track_caller]
    fn check(first: &str, second: &str, expected: Option<&str>) {
        let skill = |name: &str, more: &str| {
            let text = format!(
                "version = 1\nsummary = \"Films\"\nvehicle = \"flies\"\n{more}\noutcome = {{ done = \"success\" }}\n"
            );
            DeclaredSkill::read(&Source { path: format!("{name}.toml").into(), text }).unwrap()
        };
        let skills = DeclaredSkills::of(vec![skill("film", first), skill("photo", second)]);
        let tasks: Vec<Task> = skills.all().iter().map(|it| it.example(&[])).collect();
        assert_eq!(skills.taken_twice(&tasks).map(|(_, message)| message).as_deref(), expected);
    }
    check("", "", None);
    check("takes = [\"camera\"]", "takes = [\"gimbal\"]", None);
    let camera = "`along` names `film` and `photo`, and both take `camera`";
    check("takes = [\"camera\"]", "takes = [\"gimbal\", \"camera\"]", Some(camera));
    let relay = |number| format!("mavlink = {{ command = \"DO_SET_RELAY\", params = [{number}, 1] }}");
    let relays = "`along` names `film` and `photo`, and both take `DO_SET_RELAY`";
    check(&relay(0), &relay(1), Some(relays));
}

#[test]
fn an_input_may_be_a_text() {
    #[track_caller]
    fn check(inputs: &str, given: &str, expected: Option<&str>) {
        let text = GOOD.replace("[outcome]", &format!("[input.side]\n{inputs}\n[outcome]"));
        let declared = DeclaredSkills::of(vec![read(&text).unwrap_or_else(|it| panic!("{it}"))]);
        let side = ("side".to_owned(), Value::Text(given.into()));
        let task = Task { skill: "winch_down".into(), inputs: vec![("length_m".to_owned(), Value::Number(3.0)), side] };
        let found = declared.misfit(&task, Stance::Hovers, 10.0);
        assert_eq!(found.map(|(message, _)| message).as_deref(), expected);
    }
    let wrong = "`side` of skill `winch_down` is \"up\", expected one of left, right";
    check("choices = [\"left\", \"right\"]", "left", None);
    check("choices = [\"left\", \"right\"]", "up", Some(wrong));
    check("text = true", "up", None);
    check("text = true", "", Some("`side` of skill `winch_down` is \"\", expected a text in quotes"));
    let number = "`side` of skill `winch_down` is \"up\", expected from 1 to 2";
    check("least = 1\nmost = 2", "up", Some(number));
}

#[test]
fn mistakes_are_told_with_their_place() {
    #[track_caller]
    fn check(find: &str, replace: &str, expected: &str) {
        let read = |text: &str| DeclaredSkill::read(&Source { path: "m.toml".into(), text: text.into() });
        check_mistake(GOOD, find, replace, read, expected);
    }
    check("power_w", "power", "m.toml:7:1: unknown field `power`");
    check("< 40 m", "< 2 m", "m.toml:4:16: precondition and invariant hold at no height at which a vehicle hovers");
    let seconds = "seconds = \"2 + 2 * length_m\"";
    let never = "seconds = 2.0\npostcondition = \"not vehicle.flying\"";
    check(seconds, never, "m.toml:7:17: the postcondition does not hold where the skill is used, such as at 10 m");
    let at = "m.toml:4:16: precondition and invariant hold at no height";
    check("position.height_m < 40 m", "position.height_m > 119.6 m", at);
    check("position.height_m < 40 m", "abs(position.height_m - 9 m) < 0.5 m", at);
    check("position.height_m < 40 m", "autopilot.mode == offboard", at);
    check("< 40 m", "< 40 s", "m.toml:4:36: m and s are compared");
    check("vehicle.flying", "vehicle.flies", "m.toml:4:17: ");
    check(
        "limit_s = 60.0",
        "limit_s = 20.0",
        "m.toml:8:11: `limit_s` is 20 with length_m 20, and the skill takes 42 s",
    );
    check("2 * length_m", "2 * lenght_m", "m.toml:6:20: there is no input `lenght_m`");
    check("2 + 2", "9 - 2", "m.toml:6:11: `seconds` is -31 with length_m 20, expected 0 to 86400");
    check(seconds, "seconds = true", "m.toml:6:11: expected a number, or a text that calculates one from inputs");
    check(
        "seconds = \"2 + 2 * length_m\"\npower_w = 40.0\nlimit_s = 60.0",
        "seconds = 0\npower_w = 40.0\nlimit_s = 0",
        "m.toml:8:11: `limit_s` is 0 with length_m 1, and the skill takes 0 s",
    );
    check("interrupt_s = 5.0", "interrupt_s = 60.0", "m.toml:9:15: `interrupt_s` is 60, expected at most 10");
    check("most = 20.0", "most = 0.5", "m.toml:12:8: `most` is 0.5, expected no less than `least`, which is 1");
    check("done = \"success\"", "done = \"failure\"", "m.toml:13:1: no outcome is a success");
    check("DO_WINCH", "NAV_LAND", "m.toml:17:11: `NAV_LAND` does not command a payload");
    check("[1, \"length_m\"]", "[1, \"length\"]", "m.toml:18:14: there is no input `length` that is a number");
    let neither = "m.toml:10:8: input `length_m` is neither a number nor a text";
    check("least = 1.0\n", "", neither);
    check("most = 20.0", "most = 20.0\nchoices = [\"a\"]", neither);
    check("most = 20.0", "most = 20.0\nusual = \"a\"", "m.toml:13:9: `usual` is \"a\", expected from 1 to 20");
    check("snagged", "error", "m.toml:15:1: `error` cannot name an outcome");
    check("length_m]\nleast", "skill]\nleast", "m.toml:10:8: `skill` cannot name an input");
    check("version = 1", "version = 0", "m.toml:2:11: ");
    check("version = 1", "version = 1.5", "m.toml:2:11: ");
    check("Lowers a load on a rope", " ", "m.toml:3:11: `summary` is empty, or has a control character");
    check("[1, ", "[nan, ", "m.toml:18:11: a command cannot carry the number NaN");
    check("power_w", "takes = [\"motion\"]\npower_w", "m.toml:7:10: no declared skill takes `motion`");
    check("power_w", "takes = [\"Camera 1\"]\npower_w", "m.toml:7:10: \"Camera 1\" cannot name a payload");
    check("snagged", "cancelled", "m.toml:15:1: `cancelled` cannot name an outcome");
    check("version = 1", "version = 1\nvehicle = \"swims\"", "m.toml:3:11: unknown variant `swims`");
    check("limit_s = 60.0\n", "", "m.toml: `limit_s` is missing: the skill is used while the vehicle hovers");
    let stands = "version = 1\nvehicle = \"stands\"";
    check("version = 1", stands, "m.toml:5:16: it does not hold while a vehicle stands");
}

#[test]
fn a_skill_along_a_leg_takes_as_long_as_that() {
    #[track_caller]
    fn check(more: &str, expected: &str) {
        let flies = "version = 1\nsummary = \"Films\"\nvehicle = \"flies\"\noutcome = { done = \"success\" }\n";
        check_mistake(flies, "version = 1\n", &format!("version = 1\n{more}\n"), read, expected);
    }
    for (key, value) in [
        ("seconds", "2.0"),
        ("limit_s", "60.0"),
        ("interrupt_s", "5.0"),
        ("tries", "2"),
        ("postcondition", "\"vehicle.flying\""),
    ] {
        let message = format!("`{key}` is given, and the skill is used while the vehicle flies");
        check(&format!("{key} = {value}"), &format!("winch_down.toml:2:{}: {message}", key.len() + 4));
    }
    check(
        "invariant = \"position.height_m < 2 m\"",
        "winch_down.toml:2:13: precondition and invariant hold at no height",
    );
}
