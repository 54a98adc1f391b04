//! What a skill takes, calculated from the inputs of a task: `4 + length_m / 0.5`. The grammar is that of the rules.

use super::Problem;
use super::amount::Operation;
use super::check::{FUNCTIONS, NO_NUMBER};
use super::parser::{self, Node, Part};
use crate::file::did_you_mean;

/// A number that depends on the inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    text: String,
    node: Node,
}

impl Estimate {
    /// The same whatever the inputs are.
    pub fn constant(value: f64) -> Estimate {
        Estimate { text: value.to_string(), node: Node { part: Part::Number(value, None), span: 0..0 } }
    }

    /// Reads and checks one that is calculated from these inputs.
    ///
    /// # Errors
    /// The first thing that is wrong with it, and where.
    pub fn parse(text: &str, inputs: &[&str]) -> Result<Estimate, Problem> {
        let node = parser::parse(text)?;
        check(&node, inputs)?;
        Ok(Estimate { text: text.trim().to_owned(), node })
    }

    /// As it was written.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The number for these inputs; NaN if an input is missing.
    pub fn value(&self, input: &impl Fn(&str) -> Option<f64>) -> f64 {
        value(&self.node, input)
    }
}

fn check(node: &Node, inputs: &[&str]) -> Result<(), Problem> {
    let problem = |message: String, help: String| Err(Problem::new(node.span.clone(), message, help));
    let parts: Vec<&Node> = match &node.part {
        Part::Number(_, None) => Vec::new(),
        Part::Number(_, Some(unit)) => {
            return problem(
                format!("{unit} stands behind a number"),
                "leave units out: names of inputs end in theirs".into(),
            );
        }
        Part::Name(name) if inputs.contains(&name.as_str()) => Vec::new(),
        Part::Name(name) => return problem(format!("there is no input `{name}`"), known(name, inputs)),
        Part::Negative(inner) => vec![inner],
        Part::Pair(symbol, left, right) if Operation::of(*symbol).is_some() => vec![left, right],
        Part::Pair(..) | Part::Not(_) => return problem(NO_NUMBER.into(), String::new()),
        Part::Call(name, arguments) => {
            let fits = match name.as_str() {
                "abs" => arguments.len() == 1,
                name if FUNCTIONS.contains(&name) => 2 <= arguments.len(),
                _ => return problem(format!("there is no function `{name}`"), did_you_mean(name, &FUNCTIONS)),
            };
            if !fits {
                return problem(
                    format!("`{name}` has {} arguments", arguments.len()),
                    "write `abs(a)`, `max(a, b)`".into(),
                );
            }
            arguments.iter().collect()
        }
    };
    parts.into_iter().try_for_each(|it| check(it, inputs))
}

fn value(node: &Node, input: &impl Fn(&str) -> Option<f64>) -> f64 {
    match &node.part {
        Part::Number(number, _) => *number,
        Part::Name(name) => input(name).unwrap_or(f64::NAN),
        Part::Negative(inner) => -value(inner, input),
        Part::Pair(symbol, left, right) => {
            Operation::of(*symbol).map_or(f64::NAN, |it| it.of_numbers(value(left, input), value(right, input)))
        }
        Part::Call(name, arguments) => {
            let mut values = arguments.iter().map(|it| value(it, input));
            match name.as_str() {
                "abs" => values.next().map_or(f64::NAN, f64::abs),
                "min" => values.fold(f64::INFINITY, f64::min),
                _ => values.fold(f64::NEG_INFINITY, f64::max),
            }
        }
        Part::Not(_) => f64::NAN,
    }
}

fn known(name: &str, inputs: &[&str]) -> String {
    if inputs.is_empty() { "the skill has no input that is a number".to_owned() } else { did_you_mean(name, inputs) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: Result<f64, &str>) {
        let found = Estimate::parse(text, &["length_m", "rate_m_s"]);
        let input = |name: &str| Some(if name == "length_m" { 12.0 } else { 0.5 });
        assert_eq!(
            found.map(|it| it.value(&input)).map_err(|it| it.message),
            expected.map_err(str::to_owned),
            "{text}"
        );
    }

    #[test]
    fn it_is_calculated_from_the_inputs() {
        check("4", Ok(4.0));
        check("4 + length_m / rate_m_s", Ok(28.0));
        check("max(10, 2 * (length_m - 20))", Ok(10.0));
        check("abs(-length_m) - min(1, 2, rate_m_s)", Ok(11.5));
    }

    #[test]
    fn what_is_no_number_of_inputs_is_told() {
        check("4 s", Err("s stands behind a number"));
        check("lenght_m", Err("there is no input `lenght_m`"));
        check("length_m > 4", Err("this holds or does not, and is not a number"));
        check("sqrt(length_m)", Err("there is no function `sqrt`"));
        check("min(length_m)", Err("`min` has 1 arguments"));
        check("4 +", Err("found the end of the rule, expected a field, a number or `(`"));
    }
}
