//! What is kept between plans changes no answer.

use super::*;

/// What happens to the areas between two plans.
#[derive(Debug, Clone)]
enum Change {
    Nothing,
    /// One has other corners, another kind or other heights.
    Altered(prop::sample::Index, Area),
    Added(Area),
    Removed(prop::sample::Index),
    /// They are listed in another order.
    Rotated(prop::sample::Index),
}

fn any_change() -> impl Strategy<Value = Change> {
    let any_index = any::<prop::sample::Index>;
    prop_oneof![
        Just(Change::Nothing),
        (any_index(), any_volume(0)).prop_map(|(index, area)| Change::Altered(index, area)),
        (100..103usize).prop_flat_map(any_volume).prop_map(Change::Added),
        any_index().prop_map(Change::Removed),
        any_index().prop_map(Change::Rotated),
    ]
}

impl Change {
    fn apply(self, areas: &mut Vec<Area>) {
        match self {
            Change::Added(area) if areas.iter().all(|it| it.name != area.name) => areas.push(area),
            Change::Altered(index, area) if !areas.is_empty() => {
                let at = index.index(areas.len());
                areas[at] = Area { name: areas[at].name.clone(), ..area };
            }
            Change::Removed(index) if !areas.is_empty() => _ = areas.remove(index.index(areas.len())),
            Change::Rotated(index) if !areas.is_empty() => {
                let by = index.index(areas.len());
                areas.rotate_left(by);
            }
            Change::Nothing | Change::Added(_) | Change::Altered(..) | Change::Removed(_) | Change::Rotated(_) => {}
        }
    }
}

/// The way among `areas` for a process that knows `map`.
fn way(areas: &[Area], map: &AreaMap, asked: &Asked, from: Ned, to: Ned) -> Result<TimedWay, NoWay> {
    let grants = Grants::new();
    let rule = Airspace {
        areas,
        grants: &grants,
        clock: CLOCK,
        lead: Duration::from_secs(30),
        vertical_margin_m: 2.0,
        ground: &LEVEL,
    };
    let (entries, legs_left) = (&*entries(areas), &Cell::new(u32::MAX));
    let trip = Trip { begins: Duration::from_secs(1), ..trip(from, to) };
    find(trip, Among { rule, map, entries, asked, limits: &LIMITS, legs_left })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_process_that_kept_its_map_answers_as_one_that_did_not(
        areas in (0..8usize).prop_flat_map(|count| (0..count).map(any_volume).collect::<Vec<_>>()),
        plans in proptest::collection::vec((any_change(), 0..6u32, any::<u32>()), 1..8),
    ) {
        let mut areas = areas;
        let mut kept = AreaMap::default();
        for (change, at, bits) in plans {
            change.apply(&mut areas);
            kept.update(&areas);
            // From one of a few places, so that legs come again; some permissions are asked for before.
            let from = Ned::new(f64::from(at % 3) * 150.0 - 450.0, f64::from(at / 3) * 50.0, -10.0);
            let to = Ned::new(450.0, 30.0, if bits & 1 == 0 { -10.0 } else { -40.0 });
            let asked: Asked = (0..areas.len()).filter(|it| bits >> it & 3 == 3).collect();
            let fresh = AreaMap::new(&areas);
            prop_assert_eq!(way(&areas, &kept, &asked, from, to), way(&areas, &fresh, &asked, from, to));
        }
    }
}

#[test]
fn only_legs_near_a_changed_area_are_looked_at_again() {
    let keep_out = |index: usize| area(index, AreaKind::KeepOut, (0.0, 300.0 * index as f64), 110.0, 20);
    let mut areas: Vec<Area> = (0..10).map(keep_out).collect();
    let mut map = AreaMap::new(&areas);
    let (from, to) = (Ned::new(0.0, -200.0, -10.0), Ned::new(0.0, 3000.0, -10.0));
    way(&areas, &map, &Asked::new(), from, to).expect("there is a way");
    let all = map.legs.count();
    areas[9].ceiling_m = Some(100.0);
    map.update(&areas);
    let kept = map.legs.count();
    assert!(0 < kept && kept < all, "{kept} of {all}");
    areas.iter_mut().for_each(|it| it.ceiling_m = Some(90.0));
    map.update(&areas);
    assert_eq!(map.legs.count(), 0);
}
