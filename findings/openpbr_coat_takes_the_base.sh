#!/usr/bin/env bash
# MaterialX 1.39.5: its translation of open_pbr_surface to standard_surface gives a coated base the roughness of the coat. A rough
# metal under clear varnish becomes a mirror.
#
# OpenPBR has two lobes there: a coat of its own roughness, and a base that the coat makes rougher, never smoother. Standard
# Surface has the same two. The translation (libraries/bxdf/translation) mixes specular_roughness with coat_roughness by
# coat_weight, so that at full weight nothing of the base's roughness is left; it then sets coat_affect_roughness to 1, which
# roughens by the coat what is the coat's already. The document validates before and after. base_color and metalness do come
# through, so that the albedo looks right and only the highlight is wrong: where both libraries' own graphs are asked for the
# roughness that the base's lobe is evaluated with, 0.60 becomes 0.10, and the peak of GGX, 1 / (pi r^4), grows 1400 times.
# Without a coat the two agree. The way back (standard_surface to OpenPBR) keeps the base's roughness, but takes the coat of
# every metal away.
#
# Output seen (base: metal of roughness 0.6; coat of roughness 0.05; the base's roughness as each shader evaluates it):
#   coat 0.0: OpenPBR 0.600, translated 0.600, peak x 1.0
#   coat 0.5: OpenPBR 0.600, translated 0.342, peak x 9.5
#   coat 1.0: OpenPBR 0.600, translated 0.098, peak x 1434.3
#   back to OpenPBR, metal with a coat of weight 1: coat_weight 0.0
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check MaterialX==1.39.5
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import MaterialX as mx
from MaterialX import PyMaterialXGenShader as shaders

library = mx.createDocument()
mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
SUMS = {
    "add": lambda v: v["in1"] + v["in2"],
    "multiply": lambda v: v["in1"] * v["in2"],
    "power": lambda v: v["in1"] ** v["in2"],
    "min": lambda v: min(v["in1"], v["in2"]),
    "mix": lambda v: v["fg"] * v["mix"] + v["bg"] * (1 - v["mix"]),
    "dot": lambda v: v["in"],
    "constant": lambda v: v["value"],
    "ifgreater": lambda v: v["in1"] if v["value1"] > v["value2"] else v["in2"],
}


def value(graph, name, given):
    """The number that a node of a graph gives; ``given`` are the graph's inputs."""
    node = graph.getNode(name)
    inputs = {}
    for port in node.getActiveInputs():
        if port.getNodeName():
            inputs[port.getName()] = value(graph, port.getNodeName(), given)
        elif port.hasInterfaceName():
            inputs[port.getName()] = given[port.getInterfaceName()]
        else:
            inputs[port.getName()] = port.getValue()
    return SUMS[node.getCategory()](inputs)


def given(node):
    """The inputs of a node: its own, and the defaults of its definition."""
    defaults = {port.getName(): port.getValue() for port in library.getNodeDef(node.getNodeDefString()).getActiveInputs()}
    return defaults | {port.getName(): port.getValue() for port in node.getActiveInputs() if port.getValueString()}


def translated(category, target, **floats):
    """Inputs of a material translated to another shader: the numbers that its graph gives."""
    document = mx.createDocument()
    document.setDataLibrary(library)
    shader = document.addNode(category, "shader", "surfaceshader")
    for name, number in floats.items():
        shader.setInputValue(name, number, "float")
    document.addMaterialNode("material", shader)
    assert document.validate()[0]
    before = {port.getName(): port.getValue() for port in shader.getNodeDef().getActiveInputs()} | floats
    shaders.ShaderTranslator.create().translateAllMaterials(document, target)
    assert document.validate()[0]
    made = document.getNode("shader").getActiveInputs()[0].getNodeGraphString()
    node = document.getNodeGraph(made).getNodes()[0]
    graph = library.getNodeGraph(node.getNodeDefString().replace("ND_", "NG_"))
    values = given(node)

    def after(name):
        return value(graph, graph.getOutput(name + "_out").getNodeName(), values)

    return before, after


ok = True
PBR = library.getNodeGraph("NG_open_pbr_surface_surfaceshader")
STANDARD = library.getNodeGraph("NG_standard_surface_surfaceshader_100")
for coat in (0.0, 0.5, 1.0):
    before, after = translated(
        "open_pbr_surface", "standard_surface",
        base_metalness=1.0, specular_roughness=0.6, coat_weight=coat, coat_roughness=0.05,
    )
    names = ("specular_roughness", "coat", "coat_roughness", "coat_affect_roughness")
    own = value(PBR, "effective_specular_roughness", before)
    new = value(STANDARD, "coat_affected_roughness", {name: after(name) for name in names})
    print(f"coat {coat}: OpenPBR {own:.3f}, translated {new:.3f}, peak x {(own / new) ** 4:.1f}")
    ok &= abs(own - 0.6) < 1e-3 and abs(new - {0.0: 0.6, 0.5: 0.342, 1.0: 0.0975}[coat]) < 1e-3
_, after = translated("standard_surface", "open_pbr_surface", metalness=1.0, coat=1.0)
weight = after("coat_weight")
print(f"back to OpenPBR, metal with a coat of weight 1: coat_weight {weight}")
raise SystemExit(0 if ok and weight == 0 else "the behaviour has changed")
PY
