"""Field types of VRML97's nodes (ISO/IEC 14772-1) and of the MPEG-4 nodes that faces come with (ISO/IEC 14496-1).

XML says a value without its type, so that its reader has to know which fields are lists, numbers, strings or nodes.
"""

from __future__ import annotations

from collections.abc import Mapping

from fba.faps import LOW_LEVEL_FAPS
from formats.vrml97.face_nodes import fap_field

_INTERPOLATOR = "MFFloat key"
_BOX = "SFVec3f bboxCenter bboxSize"
_SENSOR = "SFBool enabled"
_TURNED = "SFVec3f center scale translation; SFRotation rotation scaleOrientation"
_TEXTURE = "SFBool repeatS repeatT"
_PROXIMITY = f"{_SENSOR}; SFVec3f center size"

_NODES = {
    "Anchor": f"MFNode children; SFString description; MFString parameter url; {_BOX}",
    "Appearance": "SFNode material texture textureTransform",
    "AudioClip": "SFString description; SFBool loop; SFFloat pitch; SFTime startTime stopTime; MFString url",
    "AudioSource": "MFNode children; MFString url; SFFloat pitch speed; SFTime startTime stopTime; SFInt32 numChan; "
    "MFInt32 phaseGroup",
    "Background": "MFFloat groundAngle skyAngle; MFColor groundColor skyColor; "
    "MFString backUrl bottomUrl frontUrl leftUrl rightUrl topUrl",
    "Background2D": "SFColor backColor; MFString url",
    "Billboard": f"SFVec3f axisOfRotation; MFNode children; {_BOX}",
    "Box": "SFVec3f size",
    "Circle": "SFFloat radius",
    "Collision": f"MFNode children; SFBool collide; SFNode proxy; {_BOX}",
    "Color": "MFColor color",
    "ColorInterpolator": f"{_INTERPOLATOR}; MFColor keyValue",
    "Cone": "SFFloat bottomRadius height; SFBool bottom side",
    "Coordinate": "MFVec3f point",
    "CoordinateInterpolator": f"{_INTERPOLATOR}; MFVec3f keyValue",
    "Cylinder": "SFFloat height radius; SFBool bottom side top",
    "CylinderSensor": f"{_SENSOR} autoOffset; SFFloat diskAngle maxAngle minAngle offset",
    "DirectionalLight": "SFFloat ambientIntensity intensity; SFColor color; SFVec3f direction; SFBool on",
    "ElevationGrid": "SFNode color normal texCoord; SFFloat creaseAngle xSpacing zSpacing; MFFloat height; "
    "SFBool ccw colorPerVertex normalPerVertex solid; SFInt32 xDimension zDimension",
    "Expression": "SFInt32 expression_select1 expression_intensity1 expression_select2 expression_intensity2; "
    "SFBool init_face expression_def",
    "Extrusion": "SFBool beginCap ccw convex endCap solid; SFFloat creaseAngle; MFVec2f crossSection scale; "
    "MFRotation orientation; MFVec3f spine",
    "FAP": f"SFNode viseme expression; SFInt32 {' '.join(fap_field(k) for k in LOW_LEVEL_FAPS)}",
    "FDP": "SFNode featurePointsCoord textureCoord; MFNode faceDefTables faceSceneGraph; SFBool useOrthoTexture",
    "FIT": "MFInt32 FAPs Graph numeratorExp denominatorExp numeratorImpulse numeratorTerms denominatorTerms; "
    "MFFloat numeratorCoefs denominatorCoefs",
    "Face": "SFNode fap fdp fit ttsSource; MFNode renderedFace",
    "FaceDefMesh": "SFNode faceSceneGraphNode; MFInt32 intervalBorders coordIndex; MFVec3f displacements",
    "FaceDefTables": "SFInt32 fapID highLevelSelect; MFNode faceDefMesh faceDefTransform",
    "FaceDefTransform": "SFNode faceSceneGraphNode; SFInt32 fieldId; SFRotation rotationDef; "
    "SFVec3f scaleDef translationDef",
    "Fog": "SFColor color; SFString fogType; SFFloat visibilityRange",
    "FontStyle": "MFString family justify; SFBool horizontal leftToRight topToBottom; SFString language style; "
    "SFFloat size spacing",
    "Group": f"MFNode children; {_BOX}",
    "ImageTexture": f"MFString url; {_TEXTURE}",
    "IndexedFaceSet": "SFNode color coord normal texCoord; SFBool ccw colorPerVertex convex normalPerVertex solid; "
    "SFFloat creaseAngle; MFInt32 colorIndex coordIndex normalIndex texCoordIndex",
    "IndexedLineSet": "SFNode color coord; SFBool colorPerVertex; MFInt32 colorIndex coordIndex",
    "Inline": f"MFString url; {_BOX}",
    "LOD": "MFNode level; SFVec3f center; MFFloat range",
    "Layer2D": "MFNode children; SFVec2f size; SFNode background viewport",
    "Layer3D": "MFNode children; SFVec2f size; SFNode background fog navigationInfo viewpoint",
    "Material": "SFFloat ambientIntensity shininess transparency; SFColor diffuseColor emissiveColor specularColor",
    "Material2D": "SFColor emissiveColor; SFBool filled; SFNode lineProps; SFFloat transparency",
    "MovieTexture": f"SFBool loop; SFFloat speed; SFTime startTime stopTime; MFString url; {_TEXTURE}",
    "NavigationInfo": "MFFloat avatarSize; SFBool headlight; SFFloat speed visibilityLimit; MFString type",
    "Normal": "MFVec3f vector",
    "NormalInterpolator": f"{_INTERPOLATOR}; MFVec3f keyValue",
    "OrderedGroup": "MFNode children; MFFloat order",
    "OrientationInterpolator": f"{_INTERPOLATOR}; MFRotation keyValue",
    "PixelTexture": f"SFImage image; {_TEXTURE}",
    "PlaneSensor": f"{_SENSOR} autoOffset; SFVec2f maxPosition minPosition; SFVec3f offset",
    "PointLight": "SFFloat ambientIntensity intensity radius; SFVec3f attenuation location; SFColor color; SFBool on",
    "PointSet": "SFNode color coord",
    "PositionInterpolator": f"{_INTERPOLATOR}; MFVec3f keyValue",
    "ProximitySensor": _PROXIMITY,
    "QuantizationParameter": "SFBool isLocal position3DQuant position2DQuant drawOrderQuant colorQuant "
    "textureCoordinateQuant angleQuant scaleQuant keyQuant normalQuant sizeQuant useEfficientCoding; "
    "SFVec3f position3DMin position3DMax; SFVec2f position2DMin position2DMax; SFFloat drawOrderMin drawOrderMax "
    "colorMin colorMax textureCoordinateMin textureCoordinateMax angleMin angleMax scaleMin scaleMax keyMin keyMax "
    "sizeMin sizeMax; SFInt32 position3DNbBits position2DNbBits drawOrderNbBits colorNbBits "
    "textureCoordinateNbBits angleNbBits scaleNbBits keyNbBits normalNbBits sizeNbBits",
    "Rectangle": "SFVec2f size",
    "ScalarInterpolator": f"{_INTERPOLATOR}; MFFloat keyValue",
    "Script": "MFString url; SFBool directOutput mustEvaluate",
    "Shape": "SFNode appearance geometry",
    "Sound": "SFVec3f direction location; SFFloat intensity maxBack maxFront minBack minFront priority; SFNode source; "
    "SFBool spatialize",
    "Sound2D": "SFFloat intensity; SFVec2f location; SFNode source; SFBool spatialize",
    "Sphere": "SFFloat radius",
    "SphereSensor": f"{_SENSOR} autoOffset; SFRotation offset",
    "SpotLight": "SFFloat ambientIntensity beamWidth cutOffAngle intensity radius; SFVec3f attenuation direction "
    "location; SFColor color; SFBool on",
    "Switch": "MFNode choice; SFInt32 whichChoice",
    "Text": "MFString string; SFNode fontStyle; MFFloat length; SFFloat maxExtent",
    "TextureCoordinate": "MFVec2f point",
    "TextureTransform": "SFVec2f center scale translation; SFFloat rotation",
    "TimeSensor": "SFTime cycleInterval startTime stopTime; SFBool enabled loop",
    "TouchSensor": _SENSOR,
    "Transform": f"MFNode children; {_TURNED}; {_BOX}",
    "Transform2D": "MFNode children; SFVec2f center scale translation; SFFloat rotationAngle scaleOrientation",
    "Viewpoint": "SFFloat fieldOfView; SFBool jump; SFRotation orientation; SFVec3f position; SFString description",
    "Viseme": "SFInt32 viseme_select1 viseme_select2 viseme_blend; SFBool viseme_def",
    "VisibilitySensor": _PROXIMITY,
    "WorldInfo": "MFString info; SFString title",
}


def _types(said: str) -> dict[str, str]:
    """Field name -> type of what stands as ``type name name; type name``."""
    rows = [part.split() for part in said.split(";")]
    return {name: row[0] for row in rows for name in row[1:]}


FIELDS: Mapping[str, Mapping[str, str]] = {name: _types(said) for name, said in _NODES.items()}
"""Node -> field or exposedField -> type."""


def field_type(node: str, field: str) -> str | None:
    """The type of a node's field; None if it is not known.

    >>> field_type("Shape", "geometry"), field_type("Odd", "n")
    ('SFNode', None)
    """
    return FIELDS.get(node, {}).get(field)
