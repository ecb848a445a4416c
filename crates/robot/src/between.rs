//! Auxiliary links between joints of one link that no single scene joint can represent.
//!
//! Examples are hinges with skew axes, a hinge followed by a slide across it, or six joints in a
//! row. The joints of such a link are split into groups. Each group forms one scene joint and all
//! groups but the last move an auxiliary link. An auxiliary link takes a small part of the mass
//! that the link below carries. That mass stays at its place for zero coordinates of the joints
//! below. The relative error of the motion is of the order of this part.

use super::frame::LinkFrame;
use super::joining::joined;
use super::model::{
    LinkMass, Moves, Robot, RobotForm, RobotJoint, RobotLink, RobotShape, RobotTie,
};
use std::ops::Range;
use tumble_model::shown;

/// Mass of an auxiliary link over the mass carried by the link below it. With less, transmitted
/// forces would leave visible rounding errors in its motion.
const PART: f64 = 1e-4;

/// Radius of the drawn sphere over the radius of gyration of the carried link.
const SEEN: f64 = 0.2;

/// Largest number of leading `joints` that form one scene joint.
fn together(joints: &[RobotJoint]) -> usize {
    (2..=joints.len()).rev().find(|count| joined(&joints[..*count]).is_ok()).unwrap_or(1)
}

/// Inserts auxiliary links for all links whose joints do not form one scene joint.
pub fn put(robot: &mut Robot) {
    let split = |link: usize| together(robot.joints_of(link)) < robot.joints_of(link).len();
    if !(1..robot.links.len()).any(split) {
        return;
    }
    let carried = carried(robot);
    let carriers = robot.carriers();
    let links = std::mem::take(&mut robot.links);
    // Index of each link of the file in the new list.
    let mut places: Vec<usize> = Vec::with_capacity(links.len());
    // Remaining fraction of the mass carried by each link.
    let mut left = vec![1.0; links.len()];
    for (index, link) in links.into_iter().enumerate() {
        let (mut first, count) = link.joints;
        let end = first + count;
        let mut parent = places.get(link.parent).copied().unwrap_or(0);
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

/// Adds an auxiliary link that carries `link` and is moved by the robot's `joints` with these
/// indices. Returns its index.
fn between(
    robot: &mut Robot,
    link: &RobotLink,
    parent: usize,
    frame: LinkFrame,
    joints: Range<usize>,
    carried: &LinkMass,
) -> usize {
    let index = robot.links.len();
    let own = &robot.joints[joints.clone()];
    let next = &robot.joints[joints.end];
    // The link has its centre at the anchor of a joint that turns, or of the next one.
    let hinge = own.iter().find(|joint| joint.moves != Moves::Slide);
    let position = hinge.unwrap_or(next).anchor;
    let name = format!("{}-between-{}", link.name, own[own.len() - 1].name);
    let names = robot.joints[link.joints.0..][..link.joints.1].iter();
    let names: Vec<_> = names.map(|joint| shown::line(&joint.name)).collect();
    // One note for each link
    let sentence = format!(
        "{}: {} act on one body and do not form a supported joint; a link with {PART:.0e} of its \
         mass is inserted between them",
        link.at,
        names.join(", ")
    );
    if robot.notes.last() != Some(&sentence) {
        robot.notes.push(sentence);
    }
    // A small ball makes the link visible.
    let gyration = (carried.inertia.trace() / 3.0 / carried.mass.max(f64::MIN_POSITIVE)).sqrt();
    robot.shapes.push(RobotShape {
        name: None,
        link: index,
        form: RobotForm::Sphere(SEEN * gyration.max(1e-6)),
        frame: LinkFrame { position, ..LinkFrame::identity() },
        groups: [0, 0],
        friction: None,
        turning: [0.0; 2],
        condim: 3,
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

/// Mass of each link together with all links fixed to it, in its frame.
pub fn carried(robot: &Robot) -> Vec<LinkMass> {
    let mut parts = vec![Vec::new(); robot.links.len()];
    let mut within: Vec<(usize, LinkFrame)> = Vec::with_capacity(robot.links.len());
    for (index, link) in robot.links.iter().enumerate() {
        let moves = index == 0 || link.joints.1 > 0;
        let (carrier, frame) = if moves {
            (index, LinkFrame::identity())
        } else {
            let (carrier, above) = within[link.parent];
            (carrier, above.then(&link.frame))
        };
        within.push((carrier, frame));
        if link.mass.mass > 0.0 {
            parts[carrier].push(link.mass.placed(&frame));
        }
    }
    parts.iter().map(|parts| LinkMass::sum(parts)).collect()
}

/// Renumbers all references to links. `places` maps old to new indices.
fn follow(robot: &mut Robot, places: &[usize]) {
    let Robot { links, joints, shapes, looks, sites, ties, apart, .. } = robot;
    // The last shapes belong to auxiliary links and already have the new indices.
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
