//! Unit tests of `collada.rs`.

use super::*;

/// A square of two faces in centimetres, moved and mirrored, with a red material.
#[test]
fn faces_are_fans_of_triangles_with_the_colour_of_their_material() {
    let text = r##"<COLLADA><asset><unit meter="0.01"/></asset>
          <library_effects><effect id="fx"><profile_COMMON><technique><lambert><diffuse>
            <color>1 0.5 0 1</color></diffuse></lambert></technique></profile_COMMON></effect>
          </library_effects>
          <library_materials><material id="red"><instance_effect url="#fx"/></material>
          </library_materials>
          <library_geometries><geometry id="g"><mesh>
            <source id="s"><float_array>0 0 0 100 0 0 100 100 0 0 100 0</float_array></source>
            <vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
            <polylist material="m"><input semantic="NORMAL" source="#n" offset="1"/>
              <input semantic="VERTEX" source="#v" offset="0"/>
              <vcount>4</vcount><p>0 0 1 0 2 0 3 0</p></polylist>
          </mesh></geometry></library_geometries>
          <library_visual_scenes><visual_scene id="all"><node>
            <translate>0 0 200</translate><scale>-1 1 1</scale>
            <instance_geometry url="#g"><bind_material><technique_common>
              <instance_material symbol="m" target="#red"/></technique_common></bind_material>
            </instance_geometry></node></visual_scene></library_visual_scenes>
          <scene><instance_visual_scene url="#all"/></scene></COLLADA>"##;
    let groups = triangles(text).unwrap();
    let [group] = &groups[..] else { panic!("{} groups", groups.len()) };
    assert_eq!(group.colour, Some([255, 128, 0]));
    assert_eq!(group.facets.len(), 2);
    for [a, b, c] in &group.facets {
        assert!(a.z == 2.0 && b.z == 2.0 && c.z == 2.0 && a.x == 0.0);
        // Still counter-clockwise seen from above.
        assert!((b - a).cross(&(c - a)).z > 0.0);
    }
    assert_eq!(points(text).unwrap().len(), 4);
    let broken = text.replace("0 0 1 0 2 0 3 0", "0 0 1 0 9 0 3 0");
    assert!(triangles(&broken).unwrap_err().contains("unknown vertex"));
    let bare = text.replace("symbol=\"m\"", "symbol=\"x\"");
    assert_eq!(triangles(&bare).unwrap()[0].colour, None);
}
