//! Rays in random worlds: against the signed distance along them, under symmetries, and with any
//! numbers as input.

use crate::common::cases;
use crate::pieces::*;
use crate::queried::{Queried, random};
use crate::rays::{ROUNDING, ray};
use proptest::prelude::*;
use tumble_core::query::{Query, Ray, RayHit};
use tumble_core::world::Partner;

#[test]
fn rays_in_random_worlds_end_where_the_signed_distance_vanishes() {
    let mut draw = WideDraw::wide(4);
    let (mut hits, mut several) = (0, 0);
    for round in 0..60 {
        let queried = random(&mut draw, 1 + round % 12, round % 4, 2.0);
        let query = Query::new(&queried.world, &queried.states).unwrap();
        for _ in 0..20 {
            let origin = draw.direction() * draw.within(4.0, 6.0);
            let ray = ray(origin, draw.vector(1.5) - origin);
            let all = query.cast_ray_all(&ray, |_| true);
            assert_eq!(all.first().copied(), query.cast_ray(&ray, |_| true));
            assert!(all.is_sorted_by(|a, b| a.distance <= b.distance));
            hits += all.len();
            several += usize::from(all.len() > 1);
            for of in queried.solids() {
                let hit = all.iter().find(|hit| hit.owner == of);
                let only = query.cast_ray(&ray, |other| other == of);
                assert_eq!(hit.copied(), only);
                check_object(&queried, &ray, hit, of);
            }
            if let Some(first) = all.first().filter(|first| !first.inside) {
                let short = ray.up_to(first.distance * 0.999).unwrap();
                assert!(query.cast_ray(&short, |_| true).is_none());
                let long = ray.up_to(first.distance * 1.001).unwrap();
                assert_eq!(query.cast_ray(&long, |_| true).as_ref(), Some(first));
            }
        }
    }
    assert!(hits > 500 && several > 100, "{hits} {several}");
}

/// Checks a hit with an object of several pieces, whose distance is not convex, at 100 places.
fn check_object(queried: &Queried, ray: &Ray, hit: Option<&RayHit>, of: Partner) {
    if hit.is_some_and(|hit| hit.inside) {
        assert!(queried.height(ray.origin(), of) < ROUNDING);
        return;
    }
    let end = hit.map_or(12.0, |hit| hit.distance);
    for step in 0..100 {
        let height = queried.height(&ray.at(end * f64::from(step) / 100.0), of);
        assert!(height > -ROUNDING, "{of}: {height:e} m deep before the hit");
    }
    if let Some(hit) = hit {
        let error = queried.height(&hit.point, of);
        assert!(error.abs() < ROUNDING, "{of}: the hit is {error:e} m off");
        assert!(hit.normal.dot(ray.direction()) <= 1e-9 && (hit.normal.norm() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn hits_move_with_the_world_and_do_not_depend_on_the_order_of_bodies() {
    let mut draw = WideDraw::wide(5);
    for _ in 0..40 {
        let queried = random(&mut draw, 8, 3, 2.0);
        let (motion, reversed) = (draw.pose(5.0), queried.reversed());
        let moved = queried.moved(&motion);
        let query = Query::new(&queried.world, &queried.states).unwrap();
        let other = Query::new(&reversed.world, &reversed.states).unwrap();
        let there = Query::new(&moved.world, &moved.states).unwrap();
        for _ in 0..20 {
            let origin = draw.direction() * 5.0;
            let ray_here = ray(origin, draw.vector(1.5) - origin);
            let all = query.cast_ray_all(&ray_here, |_| true);
            let same = other.cast_ray_all(&ray_here, |_| true);
            let renamed =
                same.iter().map(|hit| RayHit { owner: queried.reverse(hit.owner), ..*hit });
            assert!(renamed.eq(all.iter().copied()), "to the last bit");
            let turn = &motion.rotation;
            let origin = turn * ray_here.origin() + motion.position;
            let moved = there.cast_ray_all(&ray(origin, turn * ray_here.direction()), |_| true);
            assert_eq!(moved.len(), all.len());
            for (hit, moved) in all.iter().zip(&moved) {
                assert_eq!(hit.owner, moved.owner);
                // A ray at an angle of 1e-3 to the surface loses three digits.
                let slope = hit.normal.dot(ray_here.direction()).abs().max(1e-3);
                assert!((hit.distance - moved.distance).abs() * slope < 1e-13);
            }
        }
    }
}

proptest! {
    #![proptest_config(cases(300))]

    /// Checks that no input makes a query panic, and that hits are finite.
    #[test]
    fn ray_queries_accept_or_reject_any_numbers(
        origin in proptest::array::uniform3(any::<f64>()),
        near in proptest::array::uniform3(-2.0..2.0),
        direction in proptest::array::uniform3(any::<f64>()),
        length in any::<f64>(),
        position in proptest::array::uniform3(any::<f64>()),
        attitude in proptest::array::uniform4(any::<f64>()),
        seed in 0u64..1000,
    ) {
        let mut draw = WideDraw::wide(seed);
        let mut queried = random(&mut draw, 4, 2, 1.0);
        for origin in [origin, near] {
            let ray = Ray::new(origin.into(), direction.into());
            let ray = ray.and_then(|ray| ray.up_to(length).or(Ok(ray)));
            let query = Query::new(&queried.world, &queried.states).unwrap();
            if let Ok(ray) = ray {
                for hit in query.cast_ray_all(&ray, |_| true) {
                    prop_assert!(hit.distance.is_finite() && hit.distance >= 0.0);
                    prop_assert!((hit.normal.norm() - 1.0).abs() < 1e-9);
                }
            }
        }
        queried.states[0].position = position.into();
        let _ = Query::new(&queried.world, &queried.states);
        queried.states[1].attitude = attitude.into();
        let _ = Query::new(&queried.world, &queried.states);
        queried.states.pop();
        prop_assert!(Query::new(&queried.world, &queried.states).is_err());
    }
}
