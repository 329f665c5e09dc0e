"""What README.md says of topics and services is what the running nodes say of themselves."""

from contextlib import ExitStack
import re

import pytest

from ros_helpers import ROOT, start_node, wait_until

NODES = {
    'sim_node': {}, 'control_field_node': {}, 'learner_node': {'task': 'a_task'},
    'teleop_node': {'keyboard': False}, 'page_node': {'port': 0},
    'neighbourhood_node': {}, 'localised_odometry_node': {}}
#: Every node has these.
USUAL = {'/rosout', '/parameter_events'}
README = (ROOT / 'README.md').read_text()
#: Read instead of another topic, with other parameters than those above, or where tf2_msgs is.
NOT_RUNNING = {'/costmap', '/tf', '/tf_static'}


def rows(title):
    """Return the rows of the table below a title, as lists of cells."""
    section = README.split(f'\n## {title}\n')[1].split('\n## ')[0]
    return [line.strip('| ').split(' | ') for line in section.splitlines()
            if line.startswith('| `')]


def topics_of(observer):
    return {name: types for name, types in observer.get_topic_names_and_types()
            if name not in USUAL}


def services_of(observer, node):
    if node not in observer.get_node_names():
        return {'not there': ()}
    mine = observer.get_service_names_and_types_by_node(node, '/')
    return {name.rpartition('/')[2]: types for name, types in mine
            if types[0].startswith('std_srvs') or name.endswith(f'/{node}/request')}


@pytest.fixture(scope='module')
def nodes(ros_domain, tmp_path_factory):
    folder = tmp_path_factory.mktemp('nodes')
    with ExitStack() as stack:
        for name, parameters in NODES.items():
            extra = {'bags': str(folder)} if name == 'learner_node' else {}
            stack.enter_context(start_node(f'{name}.node', folder, parameters | extra))
        yield


def test_the_topics_are_those_of_the_running_nodes(nodes, ros_node):
    table = {}
    for names, types, *_ in rows('Topics'):
        for name in re.findall(r'`([a-z_/]+)`', names):
            table['/' + name.lstrip('/')] = types
    wait_until(lambda: set(topics_of(ros_node)) | NOT_RUNNING == set(table), node=ros_node,
               what=f'the topics {sorted(table)}')
    for name, types in topics_of(ros_node).items():
        said = table['/cmd_vel'] if table[name] == 'the same' else table[name]
        assert types[0].rpartition('/')[2] in said, name


@pytest.mark.parametrize('row', rows('Nodes'), ids=lambda row: row[0])
def test_the_services_are_those_of_the_running_node(nodes, ros_node, row):
    node = row[0].strip('`')
    said = dict(re.findall(r'`~/(\w+)`(?: \((\w+)\))?', row[2] if len(row) > 2 else ''))
    wait_until(lambda: set(services_of(ros_node, node)) == set(said), node=ros_node,
               what=f'the services {sorted(said)} of {node}')
    for name, types in services_of(ros_node, node).items():
        package = 'rcl_interfaces' if name == 'request' else 'std_srvs'
        assert types == [f'{package}/srv/{said[name] or "Trigger"}']
