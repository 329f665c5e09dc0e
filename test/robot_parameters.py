"""Whether the values of a robot's parameter file are parameters of the nodes, and in range."""

from dataclasses import fields

from control_field.parameters import Parameters
from control_field_node.settings import Settings as ControllerSettings
from learner_node.settings import Settings as LearnerSettings
from localised_odometry_node.fusion import LocalisedSettings
from neighbourhood_node.settings import NeighbourhoodSettings
from page_node.settings import Settings as PageSettings
from teleop_node.settings import Settings as TeleopSettings

KINDS = {'neighbourhood_node': [NeighbourhoodSettings],
         'localised_odometry_node': [LocalisedSettings], 'teleop_node': [TeleopSettings],
         'page_node': [PageSettings],
         'control_field_node': [ControllerSettings, Parameters],
         'learner_node': [LearnerSettings, Parameters]}


def check_parameters(values):
    """Check the values of each node, by its name: a node without a section refuses a file."""
    assert set(values) == set(KINDS)
    for name, kinds in KINDS.items():
        extra = {'task': 'a', 'bags': 'b'} if name == 'learner_node' else {}
        known = set()
        for kind in kinds:
            names = {field.name for field in fields(kind)}
            kind(**{key: value for key, value in {**extra, **values[name]}.items()
                    if key in names})
            known |= names
        assert set(values[name]) <= known
