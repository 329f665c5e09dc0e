"""What can be shown about security without a DDS that has it: policy, files, no pickle."""

import ast
from contextlib import ExitStack
import re
from xml.etree import ElementTree as ET

import pytest

from experience_cli.demo.processes import free_domain
from experience_cli.main import main
from ros_helpers import own_node, ROOT, start_node, wait_until

ROOMS = [*sorted(path.parent.name for path in ROOT.glob('*/__init__.py')), 'tools', 'launch']
RULES = {('topics', 'publish'): 'get_publisher_names_and_types_by_node',
         ('topics', 'subscribe'): 'get_subscriber_names_and_types_by_node',
         ('services', 'reply'): 'get_service_names_and_types_by_node',
         ('services', 'request'): 'get_client_names_and_types_by_node'}
POLICY = ET.parse(ROOT / 'config' / 'security_policy.xml').getroot()
PROFILES = {profile.get('node'): profile for profile in POLICY.iter('profile')}


def allowed(node, kind, right):
    """Return the full names that a node's profile allows."""
    return {('' if text.startswith('/') else '/') + text.replace('~', node)
            for block in PROFILES[node].iter(kind) if block.get(right) == 'ALLOW'
            for text in (entry.text for entry in block)}


def in_use(observer, node, method):
    if node not in observer.get_node_names():
        return set()
    return {name for name, _ in getattr(observer, method)(node, '/')}


def test_only_the_controller_may_publish_cmd_vel():
    assert [name for name in PROFILES if '/cmd_vel' in allowed(name, 'topics', 'publish')] == [
        'control_field_node']
    assert {enclave.get('path') for enclave in POLICY.iter('enclave')} == {
        f'/experience/{name}' for name in PROFILES}


def test_the_policy_allows_what_a_node_does(ros_domain, tmp_path):
    needed = {'learner_node': {'task': 'a_task', 'bags': str(tmp_path)},
              'teleop_node': {'keyboard': False},
              'page_node': {'port': 0, 'bags': str(tmp_path)}}
    # On a domain where nobody of that name has been before.
    with ExitStack() as stack:
        domain = stack.enter_context(free_domain())
        nodes = [stack.enter_context(start_node(
            f'{name}.node', tmp_path, needed.get(name), env={'ROS_DOMAIN_ID': str(domain)}))
            for name in PROFILES]
        observer = stack.enter_context(own_node(domain))
        wait_until(lambda: not differences(observer), node=observer, processes=nodes,
                   what='all that the nodes may publish',
                   report=lambda: '\n'.join(differences(observer)))
        for name in PROFILES:
            for (kind, right), method in RULES.items():
                assert in_use(observer, name, method) <= allowed(name, kind, right)


def differences(observer):
    """Return what is published and not allowed, or allowed and not published."""
    publish = 'topics', 'publish'
    pairs = {name: (in_use(observer, name, RULES[publish]), allowed(name, *publish))
             for name in PROFILES}
    # What a node does becomes known bit by bit; what it publishes is known in full.
    return [f'{name}: not published {may - does}, not allowed {does - may}'
            for name, (does, may) in pairs.items() if does != may]


def test_a_task_that_leads_out_of_the_bags_is_refused_by_the_node(quiet_domain, tmp_path):
    outside = tmp_path / 'outside'
    outside.mkdir()
    (tmp_path / 'bags').mkdir()
    (tmp_path / 'bags' / 'linked').symlink_to(outside)
    for task in ('../outside', '/etc', 'linked', '..'):
        process = start_node('learner_node.node', tmp_path, {
            'bags': str(tmp_path / 'bags'), 'task': task})
        assert process.wait() == 2, process.report()
        assert len(process.stderr.splitlines()) == 1
    assert list(outside.iterdir()) == []


def test_a_bag_that_is_a_link_out_of_the_folder_is_not_followed(tmp_path):
    outside = tmp_path / 'outside' / '0001_demo'
    outside.mkdir(parents=True)
    (tmp_path / 'bags' / 'task').mkdir(parents=True)
    (tmp_path / 'bags' / 'task' / '0001_demo').symlink_to(outside)
    main(['repair', str(tmp_path / 'bags' / 'task')])
    assert list(outside.iterdir()) == []


def test_no_array_is_unpickled():
    """All else that could run code from a file is ruff's to find (test_setup_cfg)."""
    for path in (path for room in ROOMS for path in (ROOT / room).rglob('*.py')):
        text = path.read_text()
        assert 'allow_pickle=True' not in text, path
        assert len(re.findall(r'\b(?:np|numpy)\.load\(', text)) == text.count(
            'allow_pickle=False'), path


#: Modules that open files by themselves: what they open is ours, or they are the door itself.
OPENERS = {'files.py', 'type_definitions.py', 'sqlite_recovery.py'}
#: What may be opened: descriptors, what was opened before, copies in a new folder of ours, drafts.
DOORS = {'os.open', 'Image.open', '_zstd.open', '(folder / path.stem).open', 'draft.touch'}


@pytest.mark.parametrize('room', [
    'msgs_bridge', 'episode_store', 'world_maps', 'learner_node', 'control_field_node', 'sim_node',
    'neighbourhood_node', 'localised_odometry_node', 'page_node'])
def test_what_is_not_ours_is_read_through_one_door(room):
    for path in sorted((ROOT / room).rglob('*.py')):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Call) and path.name not in OPENERS:
                name = ast.unparse(node.func)
                assert name != 'open', path
                assert name.rpartition('.')[2] not in {'read_text', 'read_bytes', 'touch'} or (
                    '.' not in name or name in DOORS), f'{path.name}: {name}'
                assert not name.endswith('.open') or name in DOORS, f'{path.name}: {name}'
