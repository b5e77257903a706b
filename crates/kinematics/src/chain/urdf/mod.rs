//! Serial chains from URDF.
//!
//! Only joints, limits and inertials are read. Transmissions, safety controllers, friction and
//! damping are not part of a [`Chain`].

mod reader;

use self::reader::{Body, Joint, Kind, Link, Origin, Robot, Rotation};
use super::inertia::Inertial;
use super::joint::{ChainJoint, JointKind};
use super::model::Chain;
use crate::error::KinematicsError;
use crate::joints::JointLimit;
use glam::{DQuat, DVec3, DVec4};
use hwall_geometry::Pose;
use hwall_numeric::check::all_finite;
use std::collections::{HashMap, HashSet};
use std::path::Path;

impl Chain {
    /// From URDF text, from link `base` to its descendant `tip`.
    ///
    /// Default `base`: the root of the tree (the root above `tip`, if given); if there are several roots, the only one with moving joints below
    /// it. Default `tip`: the end of the longest chain of moving joints. Among the links fixed to that end, the tip is `tool0`, else a flange,
    /// else the link that carries a gripper, else the only leaf, else `ee_link`, else the last moving link. A gripper is assumed after six
    /// joints, if the chain branches or the next joint of a short remainder is prismatic or mimicked; and after three joints, if the last joint
    /// has the name of a finger, or only short chains of equal length follow. [`Chain::ends`] returns the chosen links. Fixed joints are merged
    /// into their neighbours. Links attached through fixed joints add their mass; links behind other movable joints are omitted and listed in
    /// [`Chain::links_left_out`].
    ///
    /// URDF rules: rpy is roll about x, then pitch about y, then yaw about z, all in fixed axes; the
    /// default axis is x; missing `lower` and `upper` of a limit are 0. A velocity, effort or
    /// acceleration of 0 counts as not given. Since version 1.1 an origin may have `quat_xyzw`. Since
    /// version 1.2 omitted limit attributes mean unlimited, and a limit may have `acceleration`.
    /// Drake's `drake:acceleration` in a limit is read in every version.
    ///
    /// # Errors
    /// Malformed text, an undefined link, a link defined twice or with two parents, a loop, no path
    /// from base to tip, an ambiguous end without a name, a planar, floating, spherical or mimic joint
    /// on the path, a revolute or prismatic joint without limits, and whatever [`Chain::new`] rejects.
    pub fn from_urdf_str(
        text: &str,
        base: Option<&str>,
        tip: Option<&str>,
    ) -> Result<Self, KinematicsError> {
        Tree::new(&Robot::from_text(text)?)?.chain(base, tip)
    }

    /// As [`Chain::from_urdf_str`], from a file.
    ///
    /// # Errors
    /// [`KinematicsError::Io`] when the file cannot be read, else as [`Chain::from_urdf_str`].
    pub fn from_urdf_file(
        path: impl AsRef<Path>,
        base: Option<&str>,
        tip: Option<&str>,
    ) -> Result<Self, KinematicsError> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|error| KinematicsError::Io {
            path: path.display().to_string(),
            kind: error.kind(),
            message: error.to_string(),
        })?;
        // Names are ASCII, so an older encoding differs in comments only.
        let text = String::from_utf8(bytes)
            .unwrap_or_else(|error| error.into_bytes().into_iter().map(char::from).collect());
        Self::from_urdf_str(&text, base, tip)
    }
}

/// A checked tree of links.
struct Tree<'a> {
    links: HashMap<&'a str, &'a Link>,
    /// In text order, so that results do not depend on hashing.
    names: Vec<&'a str>,
    parent: HashMap<&'a str, &'a Joint>,
    children: HashMap<&'a str, Vec<&'a Joint>>,
    /// Joints that others mimic: usually gripper joints.
    mimicked: HashSet<&'a str>,
}

/// What moves below a link.
#[derive(Debug, Clone, Copy, Default)]
struct Reach {
    /// True if anything moves, mimic joints included.
    moves: bool,
    /// Largest number of independently moving joints in a row.
    longest: usize,
}

/// What moves from a joint outwards, the joint included.
fn beyond(joint: &Joint, reach: &HashMap<&str, Reach>) -> Reach {
    let below = reach.get(joint.child.as_str()).copied().unwrap_or_default();
    let moves = joint.kind != Kind::Fixed;
    Reach {
        moves: moves || below.moves,
        longest: below.longest + usize::from(moves && joint.mimics.is_none()),
    }
}

/// True if the name of the joint or its link suggests a gripper.
fn is_called_finger(joint: &Joint) -> bool {
    let names = [&joint.name, &joint.child].map(|name| name.to_ascii_lowercase());
    let words = ["finger", "gripper", "jaw", "knuckle", "claw"];
    words
        .iter()
        .any(|word| names.iter().any(|name| name.contains(word)))
}

/// An arm with at least this many joints ends where the chain branches.
const ARM: usize = 6;
/// A chain with at least this many joints is an arm, a shorter one a finger.
const SMALL_ARM: usize = 3;

impl<'a> Tree<'a> {
    fn new(robot: &'a Robot) -> Result<Self, KinematicsError> {
        let mut tree = Self {
            links: HashMap::new(),
            names: robot.links.iter().map(|link| link.name.as_str()).collect(),
            parent: HashMap::new(),
            children: HashMap::new(),
            mimicked: (robot
                .joints
                .iter()
                .filter_map(|joint| joint.mimics.as_deref()))
            .collect(),
        };
        for link in &robot.links {
            if tree.links.insert(&link.name, link).is_some() {
                return Err(KinematicsError::UrdfDuplicateLink {
                    link: link.name.clone(),
                });
            }
        }
        for joint in &robot.joints {
            let (parent, child) = (joint.parent.as_str(), joint.child.as_str());
            tree.known(parent)?;
            tree.known(child)?;
            if tree.parent.insert(child, joint).is_some() {
                return Err(KinematicsError::UrdfDuplicateLink {
                    link: child.to_owned(),
                });
            }
            tree.children.entry(parent).or_default().push(joint);
        }
        tree.check_loops()?;
        Ok(tree)
    }

    fn known(&self, link: &str) -> Result<(), KinematicsError> {
        if self.links.contains_key(link) {
            Ok(())
        } else {
            Err(KinematicsError::UrdfUnknownLink {
                link: link.to_owned(),
            })
        }
    }

    /// Every link has at most one parent, so a link that is not below a root is on or below a loop.
    fn check_loops(&self) -> Result<(), KinematicsError> {
        let mut seen: HashSet<&str> = HashSet::new();
        let mut open: Vec<&str> = self.roots().collect();
        while let Some(link) = open.pop() {
            seen.insert(link);
            open.extend(self.below(link).map(|joint| joint.child.as_str()));
        }
        match self.names.iter().find(|name| !seen.contains(**name)) {
            None => Ok(()),
            Some(link) => Err(KinematicsError::UrdfLoop {
                link: (*link).to_owned(),
            }),
        }
    }

    fn roots(&self) -> impl Iterator<Item = &'a str> {
        self.names
            .iter()
            .copied()
            .filter(|name| !self.parent.contains_key(name))
    }

    fn below(&self, link: &str) -> impl Iterator<Item = &'a Joint> {
        self.children.get(link).into_iter().flatten().copied()
    }

    fn root_above(&self, link: &'a str) -> &'a str {
        let mut at = link;
        while let Some(joint) = self.parent.get(at) {
            at = &joint.parent;
        }
        at
    }

    fn ends(
        &self,
        base: Option<&'a str>,
        tip: Option<&'a str>,
    ) -> Result<(&'a str, &'a str), KinematicsError> {
        for named in [base, tip].into_iter().flatten() {
            self.known(named)?;
        }
        let base = match (base, tip) {
            (Some(base), _) => base,
            (None, Some(tip)) => self.root_above(tip),
            (None, None) => {
                let reach = self.reach();
                let all: Vec<_> = self.roots().collect();
                let moving = all.iter().copied().filter(|root| reach[root].moves);
                match only(&moving.collect::<Vec<_>>()) {
                    Ok(root) => root,
                    Err(_) => only(&all)?,
                }
            }
        };
        let tip = match tip {
            Some(tip) => tip,
            None => self.obvious_tip(base)?,
        };
        Ok((base, tip))
    }

    /// What moves below each link.
    fn reach(&self) -> HashMap<&'a str, Reach> {
        let mut order: Vec<&'a str> = self.roots().collect();
        let mut next = 0;
        while let Some(link) = order.get(next).copied() {
            order.extend(self.below(link).map(|joint| joint.child.as_str()));
            next += 1;
        }
        let mut reach: HashMap<&str, Reach> = HashMap::new();
        for link in order.into_iter().rev() {
            let mut of_link = Reach::default();
            for joint in self.below(link) {
                let below = beyond(joint, &reach);
                of_link.moves |= below.moves;
                of_link.longest = of_link.longest.max(below.longest);
            }
            reach.insert(link, of_link);
        }
        reach
    }

    /// The end of the only arm below a link.
    fn obvious_tip(&self, base: &'a str) -> Result<&'a str, KinematicsError> {
        let reach = self.reach();
        let (mut at, mut last, mut passed) = (base, base, 0);
        let mut has_gripper = false;
        loop {
            let mut moving: Vec<(&Joint, Reach)> = (self.below(at))
                .map(|joint| (joint, beyond(joint, &reach)))
                .filter(|(_, beyond)| beyond.moves)
                .collect();
            moving.sort_by_key(|(_, beyond)| std::cmp::Reverse(beyond.longest));
            let Some(&(joint, longest)) = moving.first() else {
                break;
            };
            let is_alone = moving.len() == 1;
            let is_mimicked = self.mimicked.contains(joint.name.as_str());
            let slides = joint.kind == Kind::Prismatic;
            let is_finger = longest.longest < SMALL_ARM
                && joint.kind != Kind::Fixed
                && (passed >= ARM && (slides || is_mimicked)
                    || passed >= SMALL_ARM && longest.longest == 1 && is_called_finger(joint));
            has_gripper =
                passed > 0 && longest.longest == 0 || passed >= ARM && !is_alone || is_finger;
            if has_gripper {
                break;
            }
            let rivals = moving
                .iter()
                .filter(|(_, other)| other.longest == longest.longest);
            if rivals.clone().count() > 1 {
                has_gripper = passed >= SMALL_ARM && longest.longest < SMALL_ARM;
                if has_gripper {
                    break;
                }
                // Two arms, or many legs.
                let ends = rivals.map(|(rival, _)| self.end_below(&rival.child, &reach));
                only(&ends.collect::<Vec<_>>())?;
            }
            at = joint.child.as_str();
            if joint.kind != Kind::Fixed {
                (last, passed) = (at, passed + 1);
            }
        }
        Ok(self.tool(last, has_gripper.then_some(at)))
    }

    /// The end of the longest chain of moving joints below a link.
    fn end_below(&self, link: &'a str, reach: &HashMap<&str, Reach>) -> &'a str {
        let mut at = link;
        loop {
            let moving = self.below(at).map(|joint| (beyond(joint, reach), joint));
            let moving = moving.filter(|(beyond, _)| beyond.moves);
            match moving.max_by_key(|(beyond, _)| beyond.longest) {
                Some((_, joint)) => at = &joint.child,
                None => return at,
            }
        }
    }

    /// The end link among those fixed to the last moving link. `gripper`: the link that carries a gripper.
    fn tool(&self, last: &'a str, gripper: Option<&'a str>) -> &'a str {
        let mut fixed = vec![last];
        let mut next = 0;
        while let Some(link) = fixed.get(next).copied() {
            let joints = self.below(link).filter(|joint| joint.kind == Kind::Fixed);
            fixed.extend(joints.map(|joint| joint.child.as_str()));
            next += 1;
        }
        let called = |name: &str| {
            let mut all = fixed.iter().copied();
            all.find(|link| link.to_ascii_lowercase().ends_with(name))
        };
        let leaves: Vec<&str> = (fixed.iter().copied())
            .filter(|link| self.below(link).next().is_none())
            .collect();
        called("tool0")
            .or_else(|| called("flange"))
            .or(gripper)
            .or_else(|| only(&leaves).ok())
            .or_else(|| called("ee_link"))
            .unwrap_or(last)
    }

    fn chain(&self, base: Option<&str>, tip: Option<&str>) -> Result<Chain, KinematicsError> {
        let (base, tip) = self.ends(base, tip)?;
        let mut path: Vec<&Joint> = Vec::new();
        let mut at = tip;
        while at != base {
            let joint = self
                .parent
                .get(at)
                .ok_or_else(|| KinematicsError::UrdfDisconnected {
                    base: base.to_owned(),
                    tip: tip.to_owned(),
                })?;
            path.push(joint);
            at = &joint.parent;
        }
        path.reverse();

        let mut joints: Vec<ChainJoint> = Vec::new();
        let mut left_out = Vec::new();
        // Pose of the current link in the last moving link, or in the base.
        let mut last_from_link = Pose::IDENTITY;
        for (index, joint) in path.iter().enumerate() {
            let last_from_child = last_from_link * pose(&joint.parent_from_child)?;
            let fixed = joint.kind == Kind::Fixed;
            if fixed {
                last_from_link = last_from_child;
            } else {
                joints.push(chain_joint(joint, last_from_child)?);
                last_from_link = Pose::IDENTITY;
            }
            if let Some(carrier) = joints.last_mut() {
                let next = path.get(index + 1).map(|joint| joint.child.as_str());
                let link = self.links[joint.child.as_str()];
                self.collect(
                    link,
                    last_from_link,
                    next,
                    &mut carrier.inertials,
                    &mut left_out,
                )?;
            }
        }
        Ok(Chain::new(joints, last_from_link)?.named([base, tip], left_out))
    }

    /// Adds the mass of a link and of everything fixed to it, apart from the next link of the chain.
    fn collect(
        &self,
        link: &'a Link,
        carrier_from_link: Pose,
        next: Option<&str>,
        inertials: &mut Vec<Inertial>,
        left_out: &mut Vec<String>,
    ) -> Result<(), KinematicsError> {
        let mut open = vec![(link, carrier_from_link, true)];
        while let Some((link, carrier_from_link, rigid)) = open.pop() {
            if let Some(body) = link.body.as_ref().filter(|body| has_mass(body)) {
                if rigid {
                    inertials.push(inertial(link, body)?.transformed(&carrier_from_link));
                } else {
                    left_out.push(link.name.clone());
                }
            }
            for joint in self
                .below(&link.name)
                .filter(|joint| Some(joint.child.as_str()) != next)
            {
                let carrier_from_child = carrier_from_link * pose(&joint.parent_from_child)?;
                let rigid = rigid && joint.kind == Kind::Fixed;
                open.push((self.links[joint.child.as_str()], carrier_from_child, rigid));
            }
        }
        Ok(())
    }
}

fn only<'a>(candidates: &[&'a str]) -> Result<&'a str, KinematicsError> {
    match candidates {
        [one] => Ok(one),
        _ => {
            let mut links: Vec<String> = candidates.iter().map(|&link| link.to_owned()).collect();
            links.sort();
            Err(KinematicsError::UrdfAmbiguous { links })
        }
    }
}

fn chain_joint(joint: &Joint, previous_from_link: Pose) -> Result<ChainJoint, KinematicsError> {
    let unsupported = |kind: &str| KinematicsError::UrdfJointKind {
        joint: joint.name.clone(),
        kind: kind.to_owned(),
    };
    if joint.mimics.is_some() {
        return Err(unsupported("mimic"));
    }
    let kind = match joint.kind {
        Kind::Revolute | Kind::Continuous => JointKind::Revolute,
        Kind::Prismatic => JointKind::Prismatic,
        Kind::Floating => return Err(unsupported("floating")),
        Kind::Planar => return Err(unsupported("planar")),
        Kind::Spherical => return Err(unsupported("spherical")),
        Kind::Fixed => return Err(unsupported("fixed")),
    };
    // A limit with only zeros carries no information and would lock the joint.
    let tag = joint.limit.as_ref().filter(|limit| {
        [limit.lower, limit.upper, limit.velocity, limit.effort]
            .iter()
            .any(|value| *value != 0.0)
    });
    let limit = match tag {
        _ if joint.kind == Kind::Continuous => JointLimit::FREE,
        Some(limit) => JointLimit::new(limit.lower, limit.upper),
        None => {
            return Err(KinematicsError::UrdfNoLimits {
                joint: joint.name.clone(),
            });
        }
    };
    let given = |value: f64| (value != 0.0 && value != f64::INFINITY).then_some(value);
    Ok(ChainJoint {
        name: joint.name.clone(),
        kind,
        previous_from_link,
        axis: DVec3::from_array(joint.axis),
        limit,
        max_velocity: tag.and_then(|limit| given(limit.velocity)),
        max_effort: tag.and_then(|limit| given(limit.effort)),
        max_acceleration: tag.and_then(|limit| given(limit.acceleration)),
        inertials: Vec::new(),
    })
}

fn pose(origin: &Origin) -> Result<Pose, KinematicsError> {
    let position_m = DVec3::from_array(origin.xyz_m);
    Ok(match origin.rotation {
        Rotation::RollPitchYaw(rpy) => {
            all_finite("rpy", &rpy)?;
            Pose::from_roll_pitch_yaw(rpy, position_m)?
        }
        Rotation::Quaternion(xyzw) => {
            all_finite("quat_xyzw", &xyzw)?;
            // Zero is the identity, as in urdfdom.
            let unit = DVec4::from_array(xyzw).normalize_or(DVec4::W);
            Pose::from_quat(DQuat::from_vec4(unit), position_m)?
        }
    })
}

/// All zeros count as no inertial; zero mass with nonzero inertia is an error reported later.
fn has_mass(body: &Body) -> bool {
    body.mass_kg != 0.0 || body.inertia_kg_m2.iter().any(|value| *value != 0.0)
}

fn inertial(link: &Link, body: &Body) -> Result<Inertial, KinematicsError> {
    let in_body_axes = Inertial::from_six(
        link.name.clone(),
        body.mass_kg,
        DVec3::ZERO,
        body.inertia_kg_m2,
    );
    Ok(in_body_axes.transformed(&pose(&body.link_from_body)?))
}
