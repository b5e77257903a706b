//! Synthetic recordings of reaches in rooms, as text.

use glam::DVec3;
use hwall_testkit::Sampler;

const PLACES: [DVec3; 3] = [
    DVec3::new(0.7, 0.3, 1.0),
    DVec3::new(0.8, -0.3, 1.2),
    DVec3::new(0.6, 0.0, 0.8),
];

/// A person in a recording; the name begins with the room.
#[derive(Clone, Copy)]
pub(crate) struct Reacher {
    pub person: &'static str,
    pub reaches: usize,
    /// The reaches end this much above the objects, m.
    pub above_m: f64,
    pub has_gaze: bool,
}

impl Default for Reacher {
    fn default() -> Self {
        Self {
            person: "k1",
            reaches: 1,
            above_m: 0.0,
            has_gaze: true,
        }
    }
}

/// A recording and its trials: people reach for three objects and look at them.
pub(crate) fn files(people: &[Reacher]) -> (String, String) {
    let mut stream = String::from("person,trial,t");
    for name in ["index", "head", "gaze"] {
        stream += &["x", "y", "z"]
            .map(|axis| format!(",{name}_{axis}"))
            .concat();
    }
    let mut trials = String::from("person,trial,scene,target,cx,cy,cz,sx,sy,sz,dur,rx,ry,rz\n");
    let mut sampler = Sampler::new(1);
    let row = |v: DVec3| format!("{:.4},{:.4},{:.4}", v.x, v.y, v.z);
    let each = people
        .iter()
        .flat_map(|who| std::iter::repeat_n(who, who.reaches));
    for (n, who) in each.enumerate() {
        let (person, room) = (who.person, &who.person[..1]);
        let centre = PLACES[n % 3];
        let mut near = |m: f64| sampler.point_in_box(DVec3::splat(-m), DVec3::splat(m));
        let end = centre + near(0.05) + DVec3::Z * who.above_m;
        let start = DVec3::new(0.2, -0.2, 1.0) + near(0.02);
        let (head, dur) = (DVec3::new(0.0, 0.0, 1.6), 0.7 + near(0.1).x);
        let (centre, end_row) = (row(centre), row(end));
        trials += &format!(
            "{person},{n},{room},{},{centre},0.1,0.1,0.1,{dur},{end_row}\n",
            n % 3
        );
        for step in -10..=90 {
            let t = f64::from(step) / 90.0;
            let s = (t / dur).clamp(0.0, 1.0);
            let tip = start.lerp(end, s.powi(3) * (10.0 + s * (6.0 * s - 15.0))) + near(0.001);
            let gaze = (end + near(0.03) - head).normalize();
            let [tip, head, gaze] = [tip, head, gaze].map(row);
            let gaze = if who.has_gaze { &gaze } else { ",," };
            stream += &format!("\n{person},{n},{t:.4},{tip},{head},{gaze}");
        }
    }
    (stream, trials)
}
