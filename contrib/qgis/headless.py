"""Run the script for QGIS in QGIS's own Python: script, layer, CRS, command and folder are the words; prints JSON."""

import importlib.util
import json
import os
import sys

from qgis.core import (
    QgsApplication,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProject,
    QgsRasterLayer,
    QgsVectorLayer,
)

script, data, crs, command, folder = sys.argv[1:]
application = QgsApplication([], False)
application.initQgis()
spec = importlib.util.spec_from_file_location("projdist_distortion", script)
module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
layer = QgsVectorLayer(data, "data", "ogr")
QgsProject.instance().addMapLayer(layer)
context, feedback = QgsProcessingContext(), QgsProcessingFeedback()
context.setProject(QgsProject.instance())
wanted = {"REPORT": "report.html", "TISSOT": "tissot.gpkg", "HEATMAP": "heatmap.tif"}
parameters = {"INPUT": layer.id(), "PURPOSE": 2, "MEASURE": 0, "COMMAND": command}
parameters |= {"CRS": crs} if crs else {}
parameters |= {name: os.path.join(folder, file) for name, file in wanted.items()}
found, good = module.ProjdistDistortion().create().run(parameters, context, feedback)
answer = {"good": good, "log": feedback.textLog()}
if good:
    tissot, heatmap = QgsVectorLayer(found["TISSOT"], "tissot", "ogr"), QgsRasterLayer(found["HEATMAP"], "heatmap")
    answer |= {
        "recommended": found["RECOMMENDED"],
        "errors": json.loads(found["ERRORS"]),
        "ellipses": tissot.featureCount(),
        "crs": [tissot.crs().authid(), heatmap.crs().authid()],
        "report": os.path.getsize(found["REPORT"]),
    }
print(json.dumps(answer), flush=True)
os._exit(0)  # QGIS may crash as it takes down what Python still holds
