//! Links that stand between two joints of one link where no one joint is both.
//!
//! Hinges whose axes pass each other, a hinge and a slide across it, six joints in a row: where the joints of a link make no
//! joint that there is, the first of them that do make one move a link of their own, the rest the next one, and so on. Such
//! a link is made of a small part of the mass that the link below it carries, which stays where the coordinates of the
//! joints below it are zero: the motion is that of the file but for a part of that size.

use super::frame::LinkFrame;
use super::joining::joined;
use super::model::{
    LinkMass, Moves, Robot, RobotForm, RobotJoint, RobotLink, RobotShape, RobotTie,
};
use std::ops::Range;
use tumble_model::shown;

/// What part of the mass of the link that it carries a link between has. Of less, forces that it passes on would leave rounding
/// in its motion.
const PART: f64 = 1e-4;

/// The radius of the ball that it is drawn as, over the radius of gyration of the link that it carries.
const SEEN: f64 = 0.2;

/// How many of the first of `joints` make one joint.
fn together(joints: &[RobotJoint]) -> usize {
    (2..=joints.len()).rev().find(|count| joined(&joints[..*count]).is_ok()).unwrap_or(1)
}

/// Puts links between the joints of links whose joints make none.
pub fn put(robot: &mut Robot) {
    let split = |link: usize| together(robot.joints_of(link)) < robot.joints_of(link).len();
    if !(1..robot.links.len()).any(split) {
        return;
    }
    let carried = carried(robot);
    let carriers = robot.carriers();
    let links = std::mem::take(&mut robot.links);
    // Where each link of the file goes.
    let mut places: Vec<usize> = Vec::with_capacity(links.len());
    // What is left of the mass of what each link carries.
    let mut left = vec![1.0; links.len()];
    for (index, link) in links.into_iter().enumerate() {
        let (mut first, count) = link.joints;
        let (end, mut parent) = (first + count, places.get(link.parent).copied().unwrap_or(0));
        let mut frame = link.frame;
        loop {
            let count = together(&robot.joints[first..end]);
            if first + count >= end {
                break;
            }
            parent = between(robot, &link, parent, frame, first..first + count, &carried[index]);
            (frame, first) = (LinkFrame::identity(), first + count);
            left[index] -= PART;
        }
        places.push(robot.links.len());
        let mass = link.mass.times(left[carriers[index]]);
        robot.links.push(RobotLink { parent, frame, mass, joints: (first, end - first), ..link });
    }
    follow(robot, &places);
}

/// Adds a link that the robot's `joints` of these indices move, which carries `link`; its index.
fn between(
    robot: &mut Robot,
    link: &RobotLink,
    parent: usize,
    frame: LinkFrame,
    joints: Range<usize>,
    carried: &LinkMass,
) -> usize {
    let index = robot.links.len();
    let (own, next) = (&robot.joints[joints.clone()], &robot.joints[joints.end]);
    let hinge = own.iter().find(|joint| joint.moves != Moves::Slide);
    let position = hinge.unwrap_or(next).anchor;
    let name = format!("{}-between-{}", link.name, own[own.len() - 1].name);
    let names = robot.joints[link.joints.0..][..link.joints.1].iter();
    let names: Vec<_> = names.map(|joint| shown::line(&joint.name)).collect();
    let sentence = format!(
        "{}: {} act on one body and make no joint that there is: a link of {PART:.0e} of its mass is between them",
        link.at,
        names.join(", ")
    );
    if robot.notes.last() != Some(&sentence) {
        robot.notes.push(sentence);
    }
    let gyration = (carried.inertia.trace() / 3.0 / carried.mass.max(f64::MIN_POSITIVE)).sqrt();
    robot.shapes.push(RobotShape {
        name: name.clone(),
        link: index,
        form: RobotForm::Sphere(SEEN * gyration.max(1e-6)),
        frame: LinkFrame { position, ..LinkFrame::identity() },
        groups: [0, 0],
        friction: None,
        rubs: true,
        priority: 0,
        at: link.at.clone(),
    });
    robot.links.push(RobotLink {
        name,
        parent,
        frame,
        mass: carried.times(PART),
        weightless: link.weightless,
        is_mocap: false,
        is_between: true,
        joints: (joints.start, joints.len()),
        at: link.at.clone(),
    });
    index
}

/// What each link carries that moves with it, in its frame.
pub fn carried(robot: &Robot) -> Vec<LinkMass> {
    let mut parts = vec![Vec::new(); robot.links.len()];
    let mut within: Vec<(usize, LinkFrame)> = Vec::with_capacity(robot.links.len());
    for (index, link) in robot.links.iter().enumerate() {
        let moves = index == 0 || link.joints.1 > 0;
        let (carrier, frame) = match moves {
            true => (index, LinkFrame::identity()),
            false => {
                let (carrier, above) = within[link.parent];
                (carrier, above.then(&link.frame))
            }
        };
        within.push((carrier, frame));
        if link.mass.mass > 0.0 {
            parts[carrier].push(link.mass.placed(&frame));
        }
    }
    parts.iter().map(|parts| LinkMass::sum(parts)).collect()
}

/// Has all that stands in links of the file stand in them where they are now.
fn follow(robot: &mut Robot, places: &[usize]) {
    let Robot { links, joints, shapes, looks, sites, ties, apart, .. } = robot;
    // The last of `shapes` are those of the links between, which know where they are.
    let added = links.iter().filter(|link| link.is_between).count();
    let known = shapes.len() - added;
    shapes[..known].iter_mut().for_each(|shape| shape.link = places[shape.link]);
    looks.iter_mut().for_each(|look| look.link = places[look.link]);
    sites.iter_mut().for_each(|named| named.site.link = places[named.site.link]);
    for (index, link) in links.iter().enumerate() {
        let (first, count) = link.joints;
        joints[first..first + count].iter_mut().for_each(|joint| joint.link = index);
    }
    let pairs = ties.iter_mut().map(|tie| match tie {
        RobotTie::Point { links, .. } | RobotTie::Whole { links, .. } => links,
    });
    pairs.chain(apart).flatten().for_each(|link| *link = places[*link]);
}
