use interchange::{ids::*, mesh::*, provenance::Provenance, scene::Scene};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let sc = Scene::read(a[1].as_ref(), &[]).unwrap();
    let mut m = Mesh {
        groups: sc.groups.clone(),
        materials: vec!["m".into()],
        vertices: sc.vertices.clone(),
        ..Default::default()
    };
    for (k, f) in sc.faces.iter().enumerate() {
        let c: Vec<VertexId> = f.corners.iter().map(|&v| VertexId(v)).collect();
        m.elements.push(c.iter().copied());
        let n0 = m.node_vertices.len();
        m.element_nodes.push((0..c.len()).map(|i| NodeId::new(n0 + i)));
        m.node_vertices.extend(&c);
        m.faces.push(c.iter().copied());
        m.occluders.push(c.iter().copied());
        m.occluder_faces.push(FaceId::new(k));
        m.element_faces.push(FaceId::new(k));
        m.element_sides.push(0);
        m.face_inputs.push(k as u32);
        m.face_groups.push(f.group);
        m.face_materials.push(MaterialId(0));
        m.face_flags.push(0);
    }
    m.input_face_count = sc.faces.len() as u32;
    fn tree(c: &mut Vec<Cluster>, s: u32, e: u32) -> u32 {
        let i = c.len();
        c.push(Cluster { start: s, end: e, first_child: 0, second_child: 0 });
        if e - s > 32 {
            let mid = (s + e) / 2;
            let a = tree(c, s, mid);
            let b = tree(c, mid, e);
            c[i].first_child = a;
            c[i].second_child = b;
        }
        i as u32
    }
    let n = m.element_count() as u32;
    tree(&mut m.clusters, 0, n);
    m.write(a[2].as_ref(), Provenance::new("t", "1")).unwrap();
}
