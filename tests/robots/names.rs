//! Misspelt and unknown names in the files of robots.

use tumble_robot::model::Robot;
use tumble_robot::{Reading, read};

const FILE: &str = "<robot name='r'>\n<link name='a'>\n<inertial><mass value='1'/>\
    <inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>\n\
    <collision><origin xyz='0 0 0' rpy='0 0 0'/><geometry><box size='1 1 1'/></geometry></collision>\n</link>\n\
    <link name='b'><inertial><mass value='1'/>\
    <inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>\n\
    <joint name='j' type='revolute'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/>\n\
    <limit lower='0' upper='1' effort='9' velocity='1'/>\n<dynamics damping='0.5' friction='0.1'/></joint>\n</robot>";

#[test]
fn misspelt_names_are_refused_with_the_nearest_one() {
    for (right, wrong, line, tag) in [
        ("collision", "colision", 4, "colision"),
        ("geometry", "geomtery", 4, "geomtery"),
        ("inertial>", "inertail>", 3, "inertail"),
        ("damping", "dampng", 9, "dynamics"),
        ("effort", "efort", 8, "limit"),
        ("rpy", "ryp", 4, "origin"),
        ("axis", "axes", 7, "axes"),
    ] {
        let why = read(&FILE.replace(right, wrong), &Reading::none()).unwrap_err();
        let (right, wrong) = (right.trim_end_matches('>'), wrong.trim_end_matches('>'));
        let said = format!("{wrong} is unknown; did you mean `{right}`?");
        assert!(why.contains(&said), "{why}");
        assert!(why.starts_with(&format!("line {line}, <{tag}>")), "{why}");
    }
}

#[test]
fn other_unknown_names_are_ignored_with_a_note() {
    let notes = |text: &str| read(text, &Reading::none()).unwrap().notes;
    let usual = notes(FILE);
    assert!(usual.iter().all(|note| !note.contains("unknown")), "{usual:?}");
    let odd = FILE
        .replace("</robot>", "<gazebo><anything/></gazebo><plugins/></robot>")
        .replace("<dynamics ", "<dynamics spring_stiffness='3' ");
    let said = notes(&odd);
    let unknown =
        "unknown names are ignored: 1 <plugins> in <robot>, 1 spring_stiffness of <dynamics>";
    assert!(said.contains(&unknown.to_owned()), "{said:?}");
    let idle = "elements without effect on the motion: 1 <gazebo>";
    assert!(said.contains(&idle.to_owned()), "{said:?}");
}

#[test]
fn misspelt_names_of_an_mjcf_file_are_answered_with_the_nearest() {
    let body = |inner: &str, motor: &str| {
        format!(
            "<mujoco><worldbody><body name='arm'>{inner}<geom size='0.1'/></body></worldbody>\
             <actuator><motor joint='{motor}'/></actuator></mujoco>"
        )
    };
    let cases = [
        (body("<hinge/><joint name='elbow'/>", "elbow"), "this element is not supported in a body"),
        (body("<freejoit/>", "elbow"), "in a body; did you mean `freejoint`?"),
        (
            body("<joint name='elbow' frictionlos='1'/>", "elbow"),
            "frictionlos: this attribute is unknown; did you mean `frictionloss`?",
        ),
        (
            body("<joint name='elbow'/>", "elbw"),
            "there is no joint \"elbw\"; did you mean `elbow`?",
        ),
    ];
    for (text, said) in cases {
        let why = read(&text, &Reading::none()).unwrap_err();
        assert!(why.contains(said), "{why}");
    }
}

/// Words of MuJoCo 4: a PID actuator without an integral term is a position actuator; attributes that are 0
/// have no effect.
#[test]
fn newer_words_of_mjcf_are_read_or_refused_by_name() {
    let file = |joint: &str, geom: &str, actuator: &str| {
        format!(
            "<mujoco><worldbody><body><joint name='elbow' {joint}/><geom size='0.1' {geom}/></body>\
             </worldbody><actuator><{actuator}/></actuator></mujoco>"
        )
    };
    let pid = "pid joint='elbow' kp='3' kv='1'";
    let refused = [
        (file("springyield='1'", "", pid), "springyield: springs that yield are not supported"),
        (file("stiffness='1 2'", "", pid), "stiffness: terms of higher order are not supported"),
        (file("damping='1 0 2'", "", pid), "damping: terms of higher order are not supported"),
        (file("", "surfacevel='1 0 0'", pid), "surfacevel: moving surfaces are not read"),
        (file("", "adhesion='2'", pid), "adhesion: shapes that adhere are not read"),
        (file("", "", "pid joint='elbow' ki='2'"), "ki: an integral term is not supported"),
        (file("", "", "dcmotor joint='elbow'"), "<dcmotor>: this actuator is not supported"),
    ];
    for (text, said) in refused {
        let why = read(&text, &Reading::none()).unwrap_err();
        assert!(why.contains(said), "{why}");
    }
    let idle = file("stiffness='1 0' springyield='0'", "surfacevel='0 0 0' adhesion='0'", pid);
    let [one, other] = [idle, file("stiffness='1'", "", "position joint='elbow' kp='3' kv='1'")]
        .map(|text| read(&text, &Reading::none()).unwrap());
    let numbers = |robot: &Robot| {
        let (joint, motor) = (&robot.joints[0], &robot.actuators[0]);
        (joint.stiffness, joint.damping, motor.gain, motor.bias, motor.joints.clone())
    };
    assert_eq!(numbers(&one), numbers(&other));
}
