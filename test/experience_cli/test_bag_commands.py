"""`experience list`, `show`, `label`, `trim` and `forget` on the sample bags."""

import json
import os
import shlex
import shutil

import pytest
from rosbags.rosbag2 import Reader

from bridge_helpers import content_of, demonstration_bag, loop_bag
from episode_store.rosbag2.errors import mcap_path
from episode_store.rosbag2.reader import BagReader
from episode_store.task_folder import TaskFolder
from experience_cli.main import main
from sample_helpers import DEMO, field_of, files_of, FIRST, sample_copy, SECOND

# list and show


def test_list_says_of_every_bag_what_became_of_it(task, experience):
    shown = json.loads(experience('list', 'bags/sample', '--json'))
    assert [(bag['bag'], bag['kind'], bag['state'], bag['outcome']) for bag in shown] == [
        (DEMO, 'demo', 'kept', ''), (FIRST, 'trial', 'kept', 'goal'),
        (SECOND, 'trial', 'kept', 'goal')]
    assert shown == json.loads(experience('list', '--json'))
    for bag in shown:
        reader = BagReader(next(task.root.glob(f'{bag["bag"]}_*/*.mcap')))
        assert bag['messages'] == sum(len(reader.messages(topic)) for topic in reader.topics)
        assert (bag['size'], bag['begun']) == (reader.path.stat().st_size, None)
    lines = experience('list').splitlines()
    assert lines[0].split() == ['bag', 'kind', 'state', 'began', 'seconds', 'messages', 'steps',
                                'outcome', 'label', 'size']
    assert len(lines) == 4


def test_list_shows_cut_forgotten_labelled_and_unreadable_bags(task, experience):
    path = task.find(2).bag
    path.write_bytes(path.read_bytes()[:-1000])
    experience('forget', SECOND)
    demonstration_bag(task.root, n=60)
    broken = TaskFolder(task.root, 'task1').new_episode('demo')
    broken.bag.write_bytes(b'nothing of the kind')
    shown = {bag['bag']: bag for bag in json.loads(experience('list', 'bags', '--json'))}
    assert {name: bag['state'] for name, bag in shown.items()} == {
        DEMO: 'kept', FIRST: 'cut', SECOND: 'forgotten', 'task1/0001': 'kept',
        'task1/0002': 'unreadable'}
    assert 'experience repair' in shown[FIRST]['note']
    text = experience('list')
    assert 'forgotten' in text
    assert f'{FIRST}: mend it with' in text


def test_show_tells_topics_and_demonstration(task, experience):
    shown = json.loads(experience('show', DEMO, '--json'))
    assert shown['demonstration']['start_cell'] == [3, 4]
    assert shown['demonstration']['goal_cell'] == [9, 13]
    assert shown['demonstration']['report']['n_cells'] == shown['cells'] == 16
    assert shown['grid']['n_rows'] == 20
    assert {topic['topic'] for topic in shown['topics']} >= {'/odom', '/cmd_vel', '/trial'}
    text = experience('show', DEMO)
    assert text.startswith(
        'sample/0001: a person drove from (x, y) = (1.12, 0.88) to (3.38, 2.38) m, 15 steps')
    assert '/odom' in text


def test_show_tells_the_decisions_of_a_trial(task, experience):
    made = json.loads(experience('show', FIRST, '--json'))['decisions']
    record = content_of(task.find(2).path).record
    assert made['count'] == len(record.decisions) == sum(made['kinds'].values())
    assert made['online_reinforcements'] == record.n_online_reinforcements == len(made['notable'])
    assert 'blocked' in experience('show', FIRST)
    # What is learnt from is what `learn` counts.
    lines = experience('learn', '-v', 'bags/sample').splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith(f'{FIRST} trial '))
    assert f' {made["reinforcements"]} reinforcements learnt;' in lines[first + 1]
    assert f'; {made["reinforcements"]} reinforcements to learn from' in experience('show', FIRST)
    assert json.loads(experience('show', SECOND, '--json'))['decisions']['notable'] == []


@pytest.mark.parametrize('name', [
    FIRST, 'bags/sample/0002', 'sample/2', 'bags/sample/0002_trial', 'bags/sample/0002_trial/',
    'bags/sample/0002_trial/0002_trial_0.mcap', 'bags/sample/0002_trial/metadata.yaml'])
def test_a_bag_may_be_named_in_many_ways(task, experience, name):
    assert json.loads(experience('show', name, '--json'))['bag'] == FIRST
    assert json.loads(experience('show', str(task.path / '0002'), '--json'))['bag'] == FIRST
    os.chdir('/')
    words = ('show', FIRST, '--json', '--bags', str(task.root))
    assert json.loads(experience(*words))['bag'] == FIRST


# label


def test_a_trial_labelled_a_failure_is_learnt_from_as_one(task, experience):
    before, files = field_of(task), files_of(task.root)
    text = experience('label', FIRST, 'failure')
    assert f'{FIRST}: labelled failure' in text
    assert 'learnt anew' in text
    assert field_of(task) != before
    shown = json.loads(experience('show', FIRST, '--json'))
    assert (shown['label'], shown['outcome'], shown['state']) == ('failure', 'goal', 'kept')
    changed = {name for name, content in files_of(task.root).items() if files[name] != content}
    assert changed == {'sample/0002_trial/metadata.yaml'}
    experience('label', FIRST, 'none')
    assert field_of(task) == before
    assert files_of(task.root) == files


def test_without_its_demonstration_there_is_no_field(task, experience):
    assert 'no demonstration is left' in experience('label', DEMO, 'failure')
    assert json.loads(experience('list', '--json'))[0]['state'] == 'not kept'


# forget


@pytest.mark.parametrize('number', [2, 3])
def test_a_forgotten_bag_is_as_if_it_never_was(task, experience, tmp_path, number):
    files, whole = files_of(task.root), field_of(task)
    never = sample_copy(tmp_path, 'never')
    shutil.rmtree(never.find(number).path)
    text = experience('forget', f'sample/{number:04d}')
    assert 'is forgotten' in text
    assert 'learnt anew' in text
    assert field_of(task) == field_of(never)
    assert [episode.number for episode in task.episodes()] == sorted({1, 2, 3} - {number})
    experience('forget', '--undo', f'sample/{number:04d}')
    assert field_of(task) == whole
    assert files_of(task.root) == files


def test_the_fields_bytes_do_not_depend_on_the_gap_in_the_numbers(task, experience, tmp_path):
    """A folder that never had the bag would have numbered the later ones differently."""
    never = sample_copy(tmp_path, 'never')
    shutil.rmtree(never.find(2).path)
    last = never.find(3)
    last.bag.rename(last.path / '0002_trial_0.mcap')
    last.path.rename(never.path / '0002_trial')
    experience('forget', FIRST)
    assert field_of(task)[0] == field_of(never)[0]


def test_the_number_of_a_forgotten_bag_stays_its_own(task, experience):
    experience('forget', SECOND)
    shutil.rmtree(task.new_episode('trial').path)
    assert task.new_episode('trial').number == 4
    experience('forget', '--undo', SECOND)
    assert [episode.number for episode in task.episodes()] == [1, 2, 3, 4]


def test_forgetting_all_that_was_shown_leaves_no_field(task, experience):
    assert 'no demonstration is left' in experience('forget', DEMO)
    assert 'learnt anew' in experience('forget', '--undo', DEMO)


# trim


def test_a_cut_demonstration_keeps_its_records_byte_for_byte(task, experience):
    episode, files, whole = task.find(1), files_of(task.root), field_of(task)
    before = {channel.topic: list(BagReader(episode.bag).messages(channel.topic))
              for channel in BagReader(episode.bag).channels.values()}
    text = experience('trim', DEMO, '--from', '2', '--to', '12.5')
    assert 'is cut' in text
    after = BagReader(episode.bag)
    for topic, messages in before.items():
        left = list(after.messages(topic))
        at = messages.index(left[0])
        assert messages[at:at + len(left)] == left or topic == '/trial'
        assert topic == '/trial' or 0 < len(left) < len(messages)
    assert list(after.messages('/trial')) == before['/trial']
    shown = json.loads(experience('show', DEMO, '--json'))
    assert shown['duration'] == pytest.approx(10.5, abs=0.21)
    assert shown['state'] == 'kept'
    assert field_of(task) != whole
    assert episode.whole.read_bytes() == files['sample/0001_demo/0001_demo_0.mcap']
    experience('trim', DEMO, '--undo')
    assert field_of(task) == whole
    assert files_of(task.root) == files


def test_the_whole_recording_survives_a_second_cut(task, experience):
    whole = mcap_path(task.find(1).path).read_bytes()
    experience('label', DEMO, 'success')
    experience('trim', DEMO, '--from', '1')
    experience('trim', DEMO, '--to', '10')
    shown = json.loads(experience('show', DEMO, '--json'))
    assert shown['duration'] == pytest.approx(10.0, abs=0.21)
    assert shown['label'] == 'success'
    assert task.find(1).whole.read_bytes() == whole
    assert not list(task.path.glob('.trim*'))


def test_other_readers_read_a_cut_bag(task, experience):
    experience('trim', DEMO, '--from', '2', '--to', '12.5')
    with Reader(task.find(1).path) as reader:
        assert reader.message_count == len(list(reader.messages()))
        assert reader.duration == pytest.approx(10.5e9, abs=0.21e9)


def test_a_cut_that_would_leave_nothing_changes_nothing(task, mistake):
    files = files_of(task.root)
    assert 'left as it was' in mistake('trim', DEMO, '--to', '0.4')
    assert files_of(task.root) == files


# What is to be copied


def copied(text):
    """Return the words of the command that a text offers."""
    return shlex.split(text.split('`')[1])[1:]


def test_commands_that_are_offered_can_be_copied(task, experience, mistake, tmp_path):
    files, there = files_of(task.root), ('--bags', str(task.root))
    os.chdir('/')
    assert main(copied(experience('trim', DEMO, '--from', '2', *there))) == 0
    experience('forget', FIRST, *there)
    offered = copied(mistake('show', FIRST, *there))
    assert offered == ['forget', '--undo', FIRST, *there]
    experience(*offered)
    assert main(copied(experience('forget', str(task.path / '0002')))) == 0
    assert files_of(task.root) == files


# What users get wrong


@pytest.mark.parametrize(('words', 'says'), [
    (('show', 'sample/0009'), 'there is no bag 0009 in bags/sample'),
    (('show', 'nothing/0001'), 'there is no task folder bags/nothing'),
    (('show', 'sample'), "'sample' names no bag, must be like task1/0003"),
    (('show', '0001'), "'0001' names no bag"),
    (('show', 'sample/0002_demo'), 'sample/0002 is a trial, no demo'),
    (('show', 'bad name/0001'), "task is 'bad name', must be"),
    (('show', '../bags/sample/0001'), 'leads out of the bags folder'),
    (('forget', 'sample/../sample/0001'), 'leads out of the bags folder'),
    (('forget', 'elsewhere/sample/0001', '--bags', 'bags'), 'lies outside bags'),
    (('forget', '--undo', FIRST), 'no bag 0002 of bags/sample was forgotten'),
    (('forget', '--undo', 'sample/0002_demo'), 'no bag 0002 of bags/sample was forgotten'),
    (('list', 'nowhere'), 'there is no folder nowhere'),
    (('list', '.'), 'holds no bags'),
    (('trim', FIRST, '--from', '1'), 'only a demonstration can be cut'),
    (('trim', DEMO), 'say --from or --to'),
    (('trim', DEMO, '--undo', '--to', '3'), 'say --from or --to'),
    (('trim', DEMO, '--undo'), 'was not cut'),
    (('trim', DEMO, '--to', '300'), 'nothing to cut: sample/0001 lasts from 0 to '),
    (('show', 'smaple/0001'), 'no task folder bags/smaple; the tasks there are sample'),
    (('list', 'smaple'), 'no folder smaple; the tasks there are sample'),
    (('trim', DEMO, '--from', '9', '--to', '3'), 'must be a span within 0 and'),
    (('trim', DEMO, '--from', '-1'), 'must be a span within 0 and'),
    (('trim', DEMO, '--from', '500'), 'must be a span within 0 and'),
    (('trim', DEMO, '--from', 'nan'), 'must be a span within 0 and'),
])
def test_a_mistake_is_one_line_and_changes_nothing(task, mistake, words, says):
    files = files_of(task.root)
    line = mistake(*words)
    assert line.startswith(f'experience {words[0]}: ')
    assert says in line
    assert files_of(task.root) == files


@pytest.mark.parametrize('words', [
    ('label', FIRST, 'failure'), ('forget', FIRST), ('diff', FIRST, 'bags/sample')])
def test_a_cut_bag_is_to_be_mended_before_it_is_changed_or_compared(task, mistake, words):
    path = task.find(2).bag
    path.write_bytes(path.read_bytes()[:-500])
    assert 'experience repair bags/sample/0002_trial' in mistake(*words)


def test_a_forgotten_bag_says_how_to_bring_it_back(task, experience, mistake):
    experience('forget', FIRST)
    for words in (('show', FIRST), ('forget', FIRST)):
        assert f'experience forget --undo {FIRST}' in mistake(*words)
    assert 'is a trial, no demo' in mistake('forget', '--undo', 'sample/0002_demo')


def test_what_is_no_bag_is_said_to_be_none(task, experience, mistake):
    path = task.path / '0004_trial'
    path.mkdir()
    assert 'is no bag' in mistake('show', 'sample/0004')
    (path / '0004_trial_0.mcap').write_bytes(b'something else, and long enough to look at')
    assert 'cannot read' in mistake('show', 'sample/0004')
    assert 'not learnt anew, ' in experience('forget', FIRST)


def test_a_recorder_that_was_killed_before_it_made_its_file_spoils_nothing(task, experience):
    before = experience('learn', '--check', '--quiet', 'bags/sample')
    task.new_episode('demo')
    assert experience('learn', '--check', '--quiet', 'bags/sample') == before
    states = {bag['bag']: bag['state'] for bag in json.loads(experience('list', '--json'))}
    assert states == {DEMO: 'kept', FIRST: 'kept', SECOND: 'kept', 'sample/0004': 'cut'}
    assert 'it was empty: its recorder was stopped' in experience('repair', 'bags/sample')
    assert experience('learn', '--check', '--quiet', 'bags/sample') == before


@pytest.mark.parametrize('words', [
    ['bags/sample'], ['bags/sample/0002_trial', '--rows', '20', '--cols', '20']])
def test_a_pipe_is_no_bag_and_is_not_waited_for(task, mistake, words):
    bag = task.find(2).bag
    bag.unlink()
    os.mkfifo(bag)
    assert 'must be a regular file' in mistake('learn', *words)


def test_links_do_not_lead_out_of_the_bags_folder(task, experience, mistake, tmp_path):
    outside = sample_copy(tmp_path, 'outside')
    (task.root / 'linked').symlink_to(outside.path)
    assert {bag['bag'] for bag in json.loads(experience('list', '--json'))} == {
        DEMO, FIRST, SECOND}
    assert 'leads out of' in mistake('forget', 'linked/0001')
    bag = task.find(2).bag
    bag.unlink()
    bag.symlink_to(outside.find(2).bag)
    assert 'leads out of' in mistake('show', FIRST)
    assert len(outside.episodes()) == 3


@pytest.mark.parametrize('words', [
    ('list', 'x' * 300), ('learn', 'x' * 300), ('repair', 'x' * 300), ('inspect', 'x' * 300),
    ('show', f'{"x" * 300}/a/0001'), ('forget', 'a/0001', '--bags', 'x' * 300),
    ('diff', 'x' * 300, 'y' * 300), ('learn', 'x' * 300, '--rows', '9')])
def test_a_path_that_cannot_be_looked_at_is_one_line(task, mistake, words):
    assert 'x' * 300 in mistake(*words)


def test_a_bag_that_cannot_be_looked_at_is_listed_as_unreadable(task, experience):
    bag = task.find(2).bag
    bag.unlink()
    bag.symlink_to(task.path / ('x' * 300))
    shown = {bag['bag']: bag for bag in json.loads(experience('list', '--json'))}
    assert shown[FIRST]['state'] == 'unreadable'
    assert shown[SECOND]['state'] == 'kept'


def test_a_folder_that_cannot_be_written_is_one_line(task, mistake):
    if os.geteuid() == 0:
        pytest.skip('root may write everywhere')
    task.find(1).path.chmod(0o500)
    assert 'permission denied' in mistake('label', DEMO, 'failure')


def test_a_drive_that_ends_where_it_began_keeps_no_command_from_its_work(
    tmp_path, monkeypatch, experience, mistake,
):
    monkeypatch.chdir(tmp_path)
    loop_bag(tmp_path / 'bags')
    [bag] = json.loads(experience('list', '--json'))
    assert bag['state'] == 'not kept'
    assert 'ends in the cell where it began, so that it' in bag['note']
    for command in ('learn', 'inspect'):
        assert 'nothing was learnt' in mistake(command, 'bags/task1')
    demonstration_bag(tmp_path / 'bags')
    assert 'ends in the cell where it began' in experience('learn', 'bags/task1')
    assert 'learnt anew' in experience('label', 'task1/0001', 'success')
    text = experience('trim', 'task1/0001', '--to', '5.5')  # as it is advised
    assert 'from (0.62, 0.62) to (0.88, 1.12) m. ' in text
