//! `<compiler>`: units and conventions of a file.

use super::defaults::Defaulted;
use crate::frame::{LinkFrame, about, attitude_from_matrix, from_z};
use crate::xml::{Attributes, Element, Parsed};
use nalgebra::{Matrix3, Vector3, Vector4};
use tumble_core::mechanics::quaternion::product;

/// State of a limit. `None` stands for `auto`.
pub type Limited = Option<bool>;

/// Values `true`, `false` and `auto`.
pub const LIMITED: [(&str, Limited); 3] =
    [("true", Some(true)), ("false", Some(false)), ("auto", None)];

/// Values `true` and `false`.
pub const SWITCH: [(&str, bool); 2] = [("true", true), ("false", false)];

/// Conventions of a file.
#[derive(Debug)]
pub struct Compiler {
    degrees: bool,
    sequence: [char; 3],
    /// True to always take inertia from shapes. `None` does so for bodies without `<inertial>`.
    pub inertia_from_shapes: Limited,
    /// Range of shape groups that contribute to the inertia.
    pub inertia_groups: [f64; 2],
    autolimits: bool,
    /// Folder of the meshes.
    pub meshes: String,
    /// True to ignore the folders in file names.
    pub strip: bool,
    /// Total mass (kg).
    pub total_mass: Option<f64>,
    /// Lower bounds of mass (kg) and principal moments of inertia (kg m²).
    pub least: [f64; 2],
    /// True to correct moments of inertia that violate the triangle inequality.
    pub balanced: bool,
    /// True if `exact` is the default inertia of meshes.
    pub exact_meshes: bool,
}

/// Attributes for orientations, besides `quat`.
const ALTERNATIVES: &str = "axisangle euler xyaxes zaxis";

impl Compiler {
    /// Conventions of a file. Later elements override earlier ones.
    pub fn from_root(root: &Element) -> Parsed<Self> {
        let mut compiler = Self {
            degrees: true,
            sequence: ['x', 'y', 'z'],
            inertia_from_shapes: None,
            inertia_groups: [0.0, 5.0],
            autolimits: true,
            meshes: String::new(),
            strip: false,
            total_mass: None,
            least: [0.0; 2],
            balanced: false,
            exact_meshes: false,
        };
        for element in root.all("compiler") {
            compiler.set(element)?;
        }
        Ok(compiler)
    }

    fn set(&mut self, element: &Element) -> Parsed<()> {
        const READ: &str = "\
            angle coordinate eulerseq inertiafromgeom inertiagrouprange autolimits meshdir \
            assetdir strippath settotalmass boundmass boundinertia balanceinertia \
            exactmeshinertia alignfree fitaabb";
        const IDLE: &str = "\
            texturedir discardvisual usethread fusestatic convexhull saveinertial conflict";
        element.refuse_others(READ, IDLE)?;
        let units = [("degree", true), ("radian", false)];
        self.degrees = element.word("angle", &units)?.unwrap_or(self.degrees);
        element.word("coordinate", &[("local", ())])?;
        if element.word("alignfree", &SWITCH)? == Some(true) {
            return Err(element.wrong("alignfree: moving the frame is not supported"));
        }
        if let Some(sequence) = element.get("eulerseq") {
            let letters: Vec<char> = sequence.chars().collect();
            self.sequence = <[char; 3]>::try_from(letters)
                .ok()
                .filter(|letters| letters.iter().all(|letter| "xyzXYZ".contains(*letter)))
                .ok_or_else(|| element.wrong("eulerseq: three of x, y, z, X, Y, Z are needed"))?;
        }
        let from_shapes = element.word("inertiafromgeom", &LIMITED)?;
        self.inertia_from_shapes = from_shapes.unwrap_or(self.inertia_from_shapes);
        let groups = element.exactly::<2>("inertiagrouprange")?;
        self.inertia_groups = groups.unwrap_or(self.inertia_groups);
        self.autolimits = element.word("autolimits", &SWITCH)?.unwrap_or(self.autolimits);
        if let Some(folder) = element.get("meshdir").or(element.get("assetdir")) {
            self.meshes = folder.to_owned();
        }
        self.strip = element.word("strippath", &SWITCH)?.unwrap_or(self.strip);
        if let Some(mass) = element.number("settotalmass")? {
            self.total_mass = Some(mass).filter(|mass| *mass > 0.0);
        }
        for (least, field) in self.least.iter_mut().zip(["boundmass", "boundinertia"]) {
            *least = element.bounded(field, *least, [0.0, 1e9])?;
        }
        self.balanced = element.word("balanceinertia", &SWITCH)?.unwrap_or(self.balanced);
        self.exact_meshes = element.word("exactmeshinertia", &SWITCH)?.unwrap_or(self.exact_meshes);
        Ok(())
    }

    /// Converts an angle of the file to rad.
    pub fn angle(&self, angle: f64) -> f64 {
        if self.degrees { angle.to_radians() } else { angle }
    }

    /// Range of an attribute; `None` if the limit is inactive.
    pub fn range(
        &self,
        element: &impl Attributes,
        field: &str,
        limited: &str,
    ) -> Parsed<Option<[f64; 2]>> {
        let range = element.exactly::<2>(field)?;
        let own = element.element();
        let holds = match element.word(limited, &LIMITED)?.flatten() {
            Some(holds) => holds,
            None if self.autolimits => range.is_some(),
            None if range.is_some() => {
                return Err(own.wrong(format!("{field} needs {limited} or autolimits")));
            }
            None => false,
        };
        if !holds {
            return Ok(None);
        }
        match range {
            Some([low, high]) if low < high => Ok(Some([low, high])),
            Some(_) => Err(own.wrong(format!("{field}: the second number must be the larger one"))),
            None => Err(own.wrong(format!("{field} is needed if {limited} is true"))),
        }
    }

    /// Pose from `pos` and an orientation attribute.
    pub fn frame(&self, element: &Defaulted<'_>) -> Parsed<LinkFrame> {
        let position = element.exactly::<3>("pos")?.unwrap_or_default().into();
        let attitude = match self.attitude(element.element())? {
            Some(own) => own,
            None => self.attitude(&element.defaults())?.unwrap_or(LinkFrame::identity().attitude),
        };
        Ok(LinkFrame { position, attitude })
    }

    /// Orientation from the attributes of an element.
    pub fn attitude(&self, element: &Element) -> Parsed<Option<Vector4<f64>>> {
        let given: Vec<_> = ALTERNATIVES
            .split(' ')
            .chain(["quat"])
            .filter(|name| element.own(name).is_some())
            .collect();
        if let [first, second, ..] = given[..] {
            return Err(element.wrong(format!("only one of {first} and {second} can be given")));
        }
        let unit = |vector: Vector3<f64>, field: &str| {
            if vector.norm() > 1e-12 {
                Ok(vector.normalize())
            } else {
                Err(element.wrong(format!("{field}: the length of a vector is zero")))
            }
        };
        // One of five forms
        if let Some(quaternion) = element.exactly::<4>("quat")? {
            let quaternion = Vector4::from(quaternion);
            return if quaternion.norm() > 1e-12 {
                Ok(Some(quaternion.normalize()))
            } else {
                Err(element.wrong("the length of quat is zero"))
            };
        }
        if let Some([x, y, z, angle]) = element.exactly::<4>("axisangle")? {
            let axis = unit(Vector3::new(x, y, z), "axisangle")?;
            return Ok(Some(about(&axis, self.angle(angle))));
        }
        if let Some(angles) = element.exactly::<3>("euler")? {
            return Ok(Some(self.euler(angles)));
        }
        if let Some([a, b, c, d, e, f]) = element.exactly::<6>("xyaxes")? {
            let x = unit(Vector3::new(a, b, c), "xyaxes")?;
            let y = Vector3::new(d, e, f);
            // Gram and Schmidt: y becomes perpendicular to x.
            let y = unit(y - x * x.dot(&y), "xyaxes")?;
            let turn = Matrix3::from_columns(&[x, y, x.cross(&y)]);
            return Ok(Some(attitude_from_matrix(&turn)));
        }
        if let Some(axis) = element.exactly::<3>("zaxis")? {
            return Ok(Some(from_z(&unit(axis.into(), "zaxis")?)));
        }
        Ok(None)
    }

    /// Quaternion of three Euler angles in the sequence of the file. Lower-case letters are
    /// rotations about moving axes, upper-case letters about fixed axes.
    pub fn euler(&self, angles: [f64; 3]) -> Vector4<f64> {
        let mut attitude = LinkFrame::identity().attitude;
        for (letter, angle) in self.sequence.into_iter().zip(angles) {
            let axis = match letter.to_ascii_lowercase() {
                'x' => Vector3::x(),
                'y' => Vector3::y(),
                _ => Vector3::z(),
            };
            let turn = about(&axis, self.angle(angle));
            attitude = if letter.is_ascii_lowercase() {
                product(&attitude, &turn)
            } else {
                product(&turn, &attitude)
            };
        }
        attitude.normalize()
    }
}
