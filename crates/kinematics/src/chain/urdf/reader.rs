//! Reads the part of a URDF text that a serial chain needs.
//!
//! Shapes, appearance, transmissions and simulator extensions are skipped. Numbers may be NaN or infinite
//! here and are checked on use, so that a bad number in an unused part of the robot does no harm.

use crate::error::KinematicsError;
use roxmltree::{Document, Node, ParsingOptions};
use std::borrow::Cow;

/// Maximum number of elements, texts and comments: far more than any robot has, few enough to reject quickly.
const MOST_NODES: u32 = 200_000;
/// The parser compares every attribute of an element with all others.
const MOST_EQUALS_SIGNS_IN_A_TAG: usize = 10_000;
/// The parser's time grows with the cube of nested namespace declarations.
const MOST_NAMESPACES: usize = 500;
/// Each undeclared prefix costs one pass over the whole text.
const MOST_PREFIXES: usize = 32;
/// Parse time can grow with the square of the depth. A robot has five levels, simulator extensions a few more.
const MOST_LEVELS: usize = 200;

pub(super) struct Robot {
    pub(super) links: Vec<Link>,
    pub(super) joints: Vec<Joint>,
}

pub(super) struct Link {
    pub(super) name: String,
    pub(super) body: Option<Body>,
}

pub(super) struct Body {
    pub(super) link_from_body: Origin,
    pub(super) mass_kg: f64,
    /// xx, xy, xz, yy, yz, zz about the centre of mass, kg m², in the body's axes.
    pub(super) inertia_kg_m2: [f64; 6],
}

pub(super) struct Joint {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) parent: String,
    pub(super) child: String,
    pub(super) parent_from_child: Origin,
    pub(super) axis: [f64; 3],
    pub(super) limit: Option<Limit>,
    /// The joint that this joint follows.
    pub(super) mimics: Option<String>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Revolute,
    Continuous,
    Prismatic,
    Fixed,
    Floating,
    Planar,
    Spherical,
}

/// In the units of the joint: rad, rad/s, N m and rad/s², or m, m/s, N and m/s².
pub(super) struct Limit {
    pub(super) lower: f64,
    pub(super) upper: f64,
    pub(super) velocity: f64,
    pub(super) effort: f64,
    /// Infinite if not given.
    pub(super) acceleration: f64,
}

pub(super) struct Origin {
    pub(super) xyz_m: [f64; 3],
    pub(super) rotation: Rotation,
}

#[derive(Clone, Copy)]
pub(super) enum Rotation {
    RollPitchYaw([f64; 3]),
    /// x, y, z, w, not normalised; since URDF 1.1.
    Quaternion([f64; 4]),
}

impl Origin {
    const ZERO: Self = Self {
        xyz_m: [0.0; 3],
        rotation: Rotation::RollPitchYaw([0.0; 3]),
    };
}

/// Major and minor, so that they compare in this order.
type Version = (u32, u32);

impl Robot {
    pub(super) fn from_text(text: &str) -> Result<Self, KinematicsError> {
        // Editors may leave a byte order mark or blanks before the declaration.
        let text = text.trim_start_matches('\u{feff}').trim_start();
        check_cost(text)?;
        let text = declared(text);
        let document = parse(&text).map_err(|error| malformed(&error.to_string()))?;
        let is_macro = |node: Node| {
            let namespace = node.tag_name().namespace();
            namespace.is_some_and(|name| name.trim_end_matches('/').ends_with("xacro"))
        };
        let robot = Element(document.root_element());
        if robot.name() != "robot" {
            return Err(robot.malformed("the outermost element must be <robot>"));
        }
        let version = version(robot);
        let read = || -> Result<Self, KinematicsError> {
            let links: Result<Vec<_>, _> = robot
                .children("link")
                .map(|element| link(element, version))
                .collect();
            let joints = robot
                .children("joint")
                .map(|element| joint(element, version));
            let (links, joints) = (links?, joints.collect::<Result<_, _>>()?);
            match links.is_empty() {
                true => Err(KinematicsError::UrdfNoLinks),
                false => Ok(Self { links, joints }),
            }
        };
        // Leftover macro elements are harmless; a text that still needs macro expansion cannot be read.
        read().map_err(|error| match document.descendants().any(is_macro) {
            true => KinematicsError::UrdfXacro,
            false => error,
        })
    }
}

fn parse(text: &str) -> Result<Document<'_>, roxmltree::Error> {
    let options = ParsingOptions {
        // The parser limits entity expansion.
        allow_dtd: true,
        nodes_limit: MOST_NODES,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(text, options)
}

/// Declares all namespace prefixes of the text: simulators use undeclared ones, and other readers accept them.
fn declared(text: &str) -> Cow<'_, str> {
    let mut text = Cow::Borrowed(text);
    for _ in 0..MOST_PREFIXES {
        let Err(roxmltree::Error::UnknownNamespace(prefix, _)) = parse(&text) else {
            break;
        };
        let Some(at) = end_of_root_name(&text) else {
            break;
        };
        let declaration = format!(" xmlns:{prefix}=\"urn:undeclared:{prefix}\"");
        text.to_mut().insert_str(at, &declaration);
    }
    text
}

/// End of the root element's name.
fn end_of_root_name(text: &str) -> Option<usize> {
    let mut begin = 0;
    loop {
        begin += text[begin..].find('<')? + 1;
        let inside = &text[begin..];
        match SKIPPED
            .into_iter()
            .find(|(with, _)| inside.starts_with(with))
        {
            Some((_, end)) => begin += inside.find(end)?,
            None => {
                let ends = |c: char| c.is_whitespace() || matches!(c, '>' | '/');
                return Some(begin + inside.find(ends)?);
            }
        }
    }
}

/// Start and end markers of constructs that look like elements but are not.
const SKIPPED: [(&str, &str); 4] = [("!--", "-->"), ("![CDATA[", "]]>"), ("?", "?>"), ("!", ">")];

/// Rejects text that would keep the parser busy for minutes.
fn check_cost(text: &str) -> Result<(), KinematicsError> {
    let too_many_attributes = text
        .split('<')
        .any(|tag| tag.matches('=').count() > MOST_EQUALS_SIGNS_IN_A_TAG);
    if too_many_attributes {
        return Err(malformed("an element has too many attributes"));
    }
    if text.matches("xmlns").count() > MOST_NAMESPACES {
        return Err(malformed("too many namespaces"));
    }
    if levels(text) > MOST_LEVELS {
        return Err(malformed("elements are nested too deeply"));
    }
    Ok(())
}

/// Nesting depth of the elements, ignoring comments, character data, instructions and attributes.
fn levels(text: &str) -> usize {
    let (mut level, mut most, mut rest) = (0_usize, 0, text);
    while let Some((_, inside)) = rest.split_once('<') {
        if let Some((begin, end)) = SKIPPED
            .into_iter()
            .find(|(begin, _)| inside.starts_with(begin))
        {
            // The parser reports unterminated constructs.
            rest = inside[begin.len()..]
                .split_once(end)
                .map_or("", |(_, after)| after);
            continue;
        }
        let end = end_of_tag(inside);
        let (tag, after) = inside.split_at(end);
        if tag.starts_with('/') {
            level = level.saturating_sub(1);
        } else if !tag.ends_with('/') {
            level += 1;
            most = most.max(level);
        }
        rest = after;
    }
    most
}

/// End of the tag that begins here: the first closing bracket outside quotes.
fn end_of_tag(text: &str) -> usize {
    let mut quote = None;
    for (at, byte) in text.bytes().enumerate() {
        match (byte, quote) {
            (b'"' | b'\'', None) => quote = Some(byte),
            (_, Some(open)) if byte == open => quote = None,
            (b'>', None) => return at,
            _ => {}
        }
    }
    text.len()
}

fn version(robot: Element) -> Version {
    let given = robot.attribute("version").and_then(|text| {
        let (major, minor) = text.trim().split_once('.')?;
        Some((major.parse().ok()?, minor.parse().ok()?))
    });
    // As in urdfdom, also for a version that cannot be read.
    given.unwrap_or((1, 0))
}

fn link(link: Element, version: Version) -> Result<Link, KinematicsError> {
    Ok(Link {
        name: link.text("name")?.to_owned(),
        body: link
            .optional("inertial")?
            .map(|inertial| body(inertial, version))
            .transpose()?,
    })
}

fn body(inertial: Element, version: Version) -> Result<Body, KinematicsError> {
    let inertia = inertial.required("inertia")?;
    let mut inertia_kg_m2 = [0.0; 6];
    for (value, name) in inertia_kg_m2
        .iter_mut()
        .zip(["ixx", "ixy", "ixz", "iyy", "iyz", "izz"])
    {
        *value = inertia.number(name)?;
    }
    Ok(Body {
        link_from_body: origin(inertial, version)?,
        mass_kg: inertial.required("mass")?.number("value")?,
        inertia_kg_m2,
    })
}

/// Default joint axis.
const X: [f64; 3] = [1.0, 0.0, 0.0];

fn joint(joint: Element, version: Version) -> Result<Joint, KinematicsError> {
    Ok(Joint {
        name: joint.text("name")?.to_owned(),
        kind: kind(joint)?,
        parent: joint.required("parent")?.text("link")?.to_owned(),
        child: joint.required("child")?.text("link")?.to_owned(),
        parent_from_child: origin(joint, version)?,
        axis: match joint.optional("axis")? {
            Some(axis) => axis.numbers("xyz")?.unwrap_or(X),
            None => X,
        },
        limit: joint
            .optional("limit")?
            .map(|element| limit(element, version))
            .transpose()?,
        mimics: (joint.optional("mimic")?)
            .map(|mimic| mimic.attribute("joint").unwrap_or_default().to_owned()),
    })
}

fn kind(joint: Element) -> Result<Kind, KinematicsError> {
    Ok(match joint.text("type")? {
        "revolute" => Kind::Revolute,
        "continuous" => Kind::Continuous,
        "prismatic" => Kind::Prismatic,
        "fixed" => Kind::Fixed,
        "floating" => Kind::Floating,
        "planar" => Kind::Planar,
        "spherical" => Kind::Spherical,
        other => {
            return Err(joint.malformed(&format!("unknown joint type {:?}", shortened(other))));
        }
    })
}

/// Up to URDF 1.1 omitted values are 0 and a velocity is required; since 1.2 omitted values mean unlimited.
fn limit(limit: Element, version: Version) -> Result<Limit, KinematicsError> {
    let since_1_2 = version >= (1, 2);
    let or_unlimited = |name, unlimited: f64| {
        let otherwise = if since_1_2 { unlimited } else { 0.0 };
        let given = limit.optional_number(name);
        given.map(|value| value.unwrap_or(otherwise))
    };
    if !since_1_2 {
        limit.text("velocity")?;
    }
    // Drake's extension is read in every version; since 1.2 URDF has its own attribute.
    let acceleration = match limit.optional_number("drake:acceleration")? {
        None if since_1_2 => limit.optional_number("acceleration")?,
        given => given,
    };
    Ok(Limit {
        lower: or_unlimited("lower", f64::NEG_INFINITY)?,
        upper: or_unlimited("upper", f64::INFINITY)?,
        velocity: or_unlimited("velocity", f64::INFINITY)?,
        effort: or_unlimited("effort", f64::INFINITY)?,
        acceleration: acceleration.unwrap_or(f64::INFINITY),
    })
}

/// The origin of a joint or inertial; without one, the origin of its parent.
fn origin(owner: Element, version: Version) -> Result<Origin, KinematicsError> {
    let Some(origin) = owner.optional("origin")? else {
        return Ok(Origin::ZERO);
    };
    let rpy = origin.numbers("rpy")?;
    // Older versions lack this attribute and their readers ignore it.
    let quaternion = if version >= (1, 1) {
        origin.numbers("quat_xyzw")?
    } else {
        None
    };
    let rotation = match (rpy, quaternion) {
        (Some(_), Some(_)) => return Err(origin.malformed("both rpy and quat_xyzw are given")),
        (None, Some(quaternion)) => Rotation::Quaternion(quaternion),
        (rpy, None) => Rotation::RollPitchYaw(rpy.unwrap_or_default()),
    };
    Ok(Origin {
        xyz_m: origin.numbers("xyz")?.unwrap_or_default(),
        rotation,
    })
}

#[derive(Clone, Copy)]
struct Element<'a, 'text>(Node<'a, 'text>);

impl<'a, 'text: 'a> Element<'a, 'text> {
    fn name(self) -> &'a str {
        self.0.tag_name().name()
    }

    /// Elements in another namespace are extensions, whatever their names.
    fn children(self, name: &str) -> impl Iterator<Item = Self> {
        self.0
            .children()
            .filter(move |child| {
                let (tag, parent) = (child.tag_name(), self.0.tag_name());
                child.is_element() && tag.name() == name && tag.namespace() == parent.namespace()
            })
            .map(Self)
    }

    fn optional(self, name: &str) -> Result<Option<Self>, KinematicsError> {
        let mut found = self.children(name);
        let first = found.next();
        match found.next() {
            None => Ok(first),
            Some(second) => {
                Err(second.malformed(&format!("second of its kind in <{}>", self.name())))
            }
        }
    }

    fn required(self, name: &str) -> Result<Self, KinematicsError> {
        self.optional(name)?
            .ok_or_else(|| self.malformed(&format!("<{name}> is missing")))
    }

    /// Finds an attribute by its full name with prefix: readers of such extensions compare the prefix, not the namespace.
    fn attribute(self, name: &str) -> Option<&'a str> {
        let Some((prefix, local)) = name.split_once(':') else {
            return self.0.attribute(name);
        };
        let has_prefix = |uri| self.0.lookup_prefix(uri) == Some(prefix);
        let mut attributes = self.0.attributes();
        let found = attributes.find(|a| a.name() == local && a.namespace().is_some_and(has_prefix));
        found.map(|attribute| attribute.value())
    }

    fn text(self, attribute: &str) -> Result<&'a str, KinematicsError> {
        self.attribute(attribute)
            .ok_or_else(|| self.missing(attribute))
    }

    fn number(self, attribute: &str) -> Result<f64, KinematicsError> {
        self.optional_number(attribute)?
            .ok_or_else(|| self.missing(attribute))
    }

    fn optional_number(self, attribute: &str) -> Result<Option<f64>, KinematicsError> {
        Ok(self.numbers(attribute)?.map(|[number]| number))
    }

    /// Exactly `N` numbers separated by white space, if the attribute is given.
    fn numbers<const N: usize>(self, attribute: &str) -> Result<Option<[f64; N]>, KinematicsError> {
        let Some(text) = self.attribute(attribute) else {
            return Ok(None);
        };
        let mut words = text.split_whitespace();
        let mut numbers = [0.0; N];
        let all_read = numbers.iter_mut().all(|number| {
            let read = words.next().and_then(|word| word.parse().ok());
            *number = read.unwrap_or_default();
            read.is_some()
        });
        if all_read && words.next().is_none() {
            return Ok(Some(numbers));
        }
        let wanted = if N == 1 { "number" } else { "numbers" };
        let given = shortened(text);
        Err(self.malformed(&format!("{attribute} is {given:?}, not {N} {wanted}")))
    }

    fn missing(self, attribute: &str) -> KinematicsError {
        self.malformed(&format!("attribute {attribute} is missing"))
    }

    fn malformed(self, message: &str) -> KinematicsError {
        let start = self.0.range().start;
        let line = self.0.document().text_pos_at(start).row;
        let element = shortened(self.name());
        malformed(&format!("line {line}, <{element}>: {message}"))
    }
}

/// Joins the message to one line: the parser quotes the text with its line breaks.
fn malformed(message: &str) -> KinematicsError {
    KinematicsError::UrdfMalformed {
        message: message.replace(char::is_control, " "),
    }
}

fn shortened(text: &str) -> String {
    text.chars().take(60).collect()
}
