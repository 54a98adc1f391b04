//! Surveys of known polygons, and of any.

use proptest::prelude::*;

use super::*;

/// `(north, east)`.
fn ring(corners: &[(f64, f64)]) -> Vec<Ned> {
    corners.iter().map(|&(north, east)| Ned::new(north, east, 0.0)).collect()
}

const U: [(f64, f64); 8] = [
    (0.0, 0.0),
    (300.0, 0.0),
    (300.0, 100.0),
    (100.0, 100.0),
    (100.0, 200.0),
    (300.0, 200.0),
    (300.0, 300.0),
    (0.0, 300.0),
];

#[test]
fn lines_are_flown_to_and_fro() {
    #[track_caller]
    fn check(corners: &[(f64, f64)], spacing_m: f64, heading_deg: Option<f64>, expected: &str) {
        let survey = Survey::new(ring(corners), spacing_m, heading_deg).unwrap();
        // Adding zero makes of a negative zero a positive one.
        let whole = |metres: f64| metres.round() + 0.0;
        let turns: Vec<_> =
            survey.turns().iter().map(|it| format!("{} {}", whole(it.at.north_m), whole(it.at.east_m))).collect();
        assert_eq!(turns.join(", "), expected, "{corners:?}");
        // The corners may be listed the other way round.
        let reversed: Vec<_> = corners.iter().rev().copied().collect();
        assert_eq!(Survey::new(ring(&reversed), spacing_m, heading_deg).unwrap().turns().len(), survey.turns().len());
    }
    let field = [(100.0, 0.0), (300.0, 0.0), (300.0, 90.0), (100.0, 90.0)];
    check(&field, 30.0, None, "100 15, 300 15, 300 45, 100 45, 100 75, 300 75");
    check(&field, 30.0, Some(180.0), "100 15, 300 15, 300 45, 100 45, 100 75, 300 75");
    check(&field, 100.0, Some(90.0), "150 0, 150 90, 250 90, 250 0");
    // Narrower than the spacing: one line in the middle.
    check(&field, 500.0, None, "100 45, 300 45");
    // As few lines as cover the width, with the same room at both borders.
    check(&field, 80.0, None, "100 5, 300 5, 300 85, 100 85");
    check(&[(0.0, 0.0), (100.0, 0.0), (0.0, 100.0)], 50.0, Some(0.0), "0 25, 75 25, 25 75, 0 75");
    // One arm of the U after the other, and then what joins them.
    check(&U, 100.0, Some(90.0), "50 0, 50 300, 150 300, 150 200, 250 200, 250 300, 250 100, 250 0, 150 0, 150 100");
    // Along its arms it is one cell.
    check(&U, 100.0, Some(0.0), "0 50, 300 50, 100 150, 0 150, 0 250, 300 250");
}

#[test]
fn the_heading_is_the_one_with_the_fewest_lines() {
    // 400 m long and 100 m wide, turned by 30 degrees.
    let (sin, cos) = 30_f64.to_radians().sin_cos();
    let turned = |(along, across): (f64, f64)| (along * cos - across * sin, along * sin + across * cos);
    let corners = ring(&[(0.0, 0.0), (400.0, 0.0), (400.0, 100.0), (0.0, 100.0)].map(turned));
    let lines = |heading_deg| {
        let survey = Survey::new(corners.clone(), 20.0, heading_deg).unwrap();
        survey.turns().iter().filter(|it| it.ends_line).count()
    };
    assert_eq!((lines(None), lines(Some(30.0)), lines(Some(120.0))), (5, 5, 20));
    assert!((0..180).all(|it| 5 <= lines(Some(f64::from(it)))));
}

#[test]
fn what_cannot_be_flown_is_refused() {
    #[track_caller]
    fn check(corners: &[(f64, f64)], spacing_m: f64, heading_deg: Option<f64>, expected: &str) {
        let refusal = Survey::new(ring(corners), spacing_m, heading_deg).unwrap_err();
        assert_eq!(refusal.to_string(), expected);
    }
    let shape = "it crosses itself, has fewer than three corners or encloses nothing";
    check(&[], 30.0, None, shape);
    check(&[(0.0, 0.0), (9.0, 0.0)], 30.0, None, shape);
    check(&[(0.0, 0.0), (9.0, 9.0), (9.0, 0.0), (0.0, 9.0)], 30.0, None, shape);
    check(&[(0.0, 0.0), (50.0, 0.0), (25.0, 0.0)], 30.0, None, shape);
    check(&[(5.0, 5.0); 4], 30.0, None, shape);
    check(&U, f64::NAN, None, "its spacing is NaN m, expected 5 to 10000 m");
    check(&U, 0.0, None, "its spacing is 0 m, expected 5 to 10000 m");
    check(&U, 30.0, Some(f64::INFINITY), "its heading is inf, expected degrees from -360 to 360");
    check(&[(0.0, 0.0), (f64::NAN, 0.0), (0.0, 9.0)], 30.0, None, "it has a corner more than 100 km from the origin");
    check(&[(0.0, 0.0), (9e4, 0.0), (9e4, 1e3), (0.0, 1e3)], 5.0, None, "it has 200 lines, expected at most 100");
    check(&[(0.0, 0.0); 501], 30.0, None, "it has 501 corners, expected at most 500");
    // 60 teeth: each line along the comb's back meets all of them.
    let teeth = (0..60).flat_map(|it| {
        let north = f64::from(it) * 20.0;
        [(north, 50.0), (north, 100.0), (north + 10.0, 100.0), (north + 10.0, 50.0)]
    });
    let comb: Vec<_> = teeth.chain([(1190.0, 0.0), (0.0, 0.0)]).collect();
    check(&comb, 25.0, Some(0.0), "it has 122 lines, expected at most 100");
}

#[test]
fn what_was_passed_grows_and_leaves_the_goal() {
    let survey = Survey::new(ring(&U), 100.0, Some(0.0)).unwrap();
    let passed = |counts: &[usize]| counts.iter().fold(survey.clone(), |survey, it| survey.with_passed(*it)).passed();
    assert_eq!((passed(&[2]), passed(&[4, 2]), passed(&[usize::MAX])), (2, 4, 5));
}

/// Star-shaped, so mostly concave, and never crossing itself.
fn polygons() -> impl Strategy<Value = Vec<Ned>> {
    let radii = prop::collection::vec(40.0..400.0, 3..14);
    (radii, -2000.0..2000.0, -2000.0..2000.0).prop_map(|(radii, north_m, east_m)| {
        let count = radii.len() as f64;
        let corner = |(index, radius): (usize, f64)| {
            let (sin, cos) = (std::f64::consts::TAU * index as f64 / count).sin_cos();
            Ned::new(north_m + radius * cos, east_m + radius * sin, 0.0)
        };
        radii.into_iter().enumerate().map(corner).collect()
    })
}

/// Metres from `at` to the nearest line.
fn distance_m(survey: &Survey, at: Ned) -> f64 {
    let lines = survey.turns().windows(2).filter(|it| it[1].ends_line);
    let to_line_m = |line: &[Turn]| {
        let (from, to) = (line[0].at, line[1].at);
        let (north, east) = (to.north_m - from.north_m, to.east_m - from.east_m);
        let along = (at.north_m - from.north_m) * north + (at.east_m - from.east_m) * east;
        at.horizontal_distance_m(from.towards(to, (along / (north * north + east * east)).clamp(0.0, 1.0)))
    };
    lines.map(to_line_m).fold(f64::INFINITY, f64::min)
}

proptest! {
    #[test]
    fn every_line_is_flown_once_inside_of_the_polygon(
        corners in polygons(), spacing_m in 15.0..80.0, heading_deg in prop::option::of(-360.0..360.0),
    ) {
        let survey = Survey::new(corners.clone(), spacing_m, heading_deg);
        prop_assume!(survey.is_ok());
        let survey = survey.unwrap();
        let area = area_of(&corners);
        let frame = Frame::along(heading_deg.map_or_else(|| heading_of_fewest_lines(&area).unwrap(), f64::to_radians));
        for line in survey.turns().windows(2).filter(|it| it[1].ends_line) {
            // Where it begins too close to the end of the line before, it is flown to from there.
            let is_inside = |share: f64| {
                let at = line[0].at.towards(line[1].at, share);
                area.covers(at) || area.distance_to_border_m(at) < LEAST_SPACING_M
            };
            prop_assert!([0.01, 0.3, 0.5, 0.7, 0.99].into_iter().all(is_inside), "{line:?}");
        }
        let pieces: Vec<Piece> = frame.pieces(&corners, spacing_m).unwrap().into_iter().flatten().collect();
        // A line is shorter at its beginning where that is too close to the end of the one before.
        let least_m: f64 = pieces.iter().map(|it| it.along_m[1] - it.along_m[0] - 2.0 * LEAST_SPACING_M).sum();
        let most_m: f64 = pieces.iter().map(|it| it.along_m[1] - it.along_m[0] + LEAST_SPACING_M).sum();
        let lines = survey.turns().windows(2).filter(|it| it[1].ends_line);
        let flown_m: f64 = lines.map(|it| it[0].at.horizontal_distance_m(it[1].at)).sum();
        prop_assert!(least_m <= flown_m && flown_m <= most_m, "{flown_m} m of {least_m} to {most_m} m");
        for piece in pieces.iter().filter(|it| 3.0 * LEAST_SPACING_M < it.along_m[1] - it.along_m[0]) {
            for share in [0.01, 0.3, 0.7, 0.99] {
                let along_m = piece.along_m[0] + (piece.along_m[1] - piece.along_m[0]) * share;
                let apart_m = distance_m(&survey, frame.place(along_m, piece.across_m));
                prop_assert!(apart_m < LEAST_SPACING_M, "{apart_m} m from {piece:?}");
            }
        }
    }

    #[test]
    fn nothing_inside_is_farther_than_half_a_spacing_from_the_lines(
        corners in polygons(), spacing_m in 15.0..80.0, heading_deg in -360.0..360.0,
    ) {
        let survey = Survey::new(corners.clone(), spacing_m, Some(heading_deg));
        prop_assume!(survey.is_ok());
        let frame = Frame::along(heading_deg.to_radians());
        let across_m: Vec<f64> = frame.pieces(&corners, spacing_m).unwrap().iter().flatten().map(|it| it.across_m).collect();
        for corner in &corners {
            let apart_m = across_m.iter().map(|it| (it - frame.across_m(*corner)).abs()).fold(f64::INFINITY, f64::min);
            prop_assert!(apart_m <= spacing_m / 2.0 + 1e-6, "{apart_m} m of {spacing_m}");
        }
        let turns = survey.unwrap().turns().to_vec();
        prop_assert!(turns.windows(2).all(|it| LEAST_SPACING_M <= it[0].at.horizontal_distance_m(it[1].at)));
        prop_assert!(turns.len() <= 2 * MOST_LINES);
    }
}
