"""Run in an environment of its own: ``python mediapipe_faces.py PICTURE...`` prints the face mesh of each as JSON."""

from __future__ import annotations

import json
import sys
from importlib import import_module


def main(paths: list[str]) -> None:
    """Print, for each picture, the landmarks of its first face as [x, y] pixels; an empty list where there is none."""
    import numpy as np

    # Pillow is not among MediaPipe's requirements, OpenCV is; it turns a photograph as its camera says.
    cv2, mediapipe = import_module("cv2"), import_module("mediapipe")
    found: list[list[list[float]]] = []
    with mediapipe.solutions.face_mesh.FaceMesh(static_image_mode=True, max_num_faces=1) as mesh:
        for path in paths:
            picture = cv2.imread(path, cv2.IMREAD_COLOR)
            if picture is None:
                sys.exit(f"{path} cannot be read")
            height, width = picture.shape[:2]
            faces = mesh.process(np.ascontiguousarray(picture[..., ::-1])).multi_face_landmarks
            places = faces[0].landmark if faces else ()
            found.append([[p.x * width - 0.5, p.y * height - 0.5] for p in places])
    json.dump(found, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1:])
