"""The node `page_node` on real sockets and topics, without a browser."""

from contextlib import ExitStack, suppress
from itertools import count
import json
import socket
from urllib.request import build_opener, HTTPCookieProcessor

from nav_msgs.msg import Odometry
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from msgs_bridge.messages.poses import odometry_from_pose, Pose
from page_sites import AHEAD, command, running_site, Site, SPEED, STANDING, STANDSTILL, tell
import ros_helpers


def wait_for_close(websocket):
    with suppress(ConnectionClosed):
        while True:
            websocket.recv(timeout=ros_helpers.DEADLINE)


def who_drives(websocket):
    message = json.loads(websocket.recv(timeout=ros_helpers.DEADLINE))
    assert message['type'] == 'driver', message
    return message['who']


class TestDriving:
    def test_what_is_held_moves_the_robot_and_letting_go_stops_it(self, page_site, robot):
        with page_site.socket('/drive') as drive:
            robot.drive_by(drive)
            command(drive, STANDING)
            robot.wait(robot.stands, 'the standstill')
            assert {velocity for _, velocity in robot.heard} == {SPEED, STANDSTILL}

    @pytest.mark.parametrize('close', [
        lambda drive: drive.close(), lambda drive: drive.socket.close(),
        lambda drive: drive.socket.shutdown(socket.SHUT_RDWR)],
        ids=['closed', 'dropped', 'shut down'])
    def test_a_socket_that_closes_stops_the_robot(self, page_site, robot, close):
        with page_site.socket('/drive') as drive:
            robot.drive_by(drive)
            close(drive)
            robot.wait(robot.stands, 'the standstill')

    def test_a_socket_that_is_silent_stops_the_robot(self, page_site, robot):
        with page_site.socket('/drive') as drive:
            robot.drive_by(drive)
            robot.wait(robot.stands, 'the standstill')

    def test_old_commands_are_dropped(self, page_site, robot):
        with page_site.socket('/drive') as drive:
            command(drive, STANDING)
            for age in (0.3, 1.0, 60.0):
                command(drive, AHEAD, age)
            tell(drive, {'stop': True})
            robot.wait(robot.stands, 'the standstill after them')
            assert not any(velocity == SPEED for _, velocity in robot.heard)

    def test_one_drives_and_the_others_see_who(self, page_site, robot):
        with page_site.socket('/drive') as one, page_site.socket('/drive') as other:
            assert who_drives(one) == who_drives(other) == 'nobody'
            robot.drive_by(one)
            assert who_drives(one) == 'you'
            assert who_drives(other) == 'other'
            command(other, {'v': -1.0, 'w': 1.0})
            robot.drive_by(one)
            assert {velocity for _, velocity in robot.heard} <= {SPEED, STANDSTILL}

    def test_anybody_may_stop(self, page_site, robot):
        with page_site.socket('/drive') as one, page_site.socket('/drive') as other:
            robot.drive_by(one)
            tell(other, {'stop': True})
            robot.wait(robot.stands, 'the standstill')
            robot.heard.clear()
            for _ in range(10):
                command(one, AHEAD)  # held on: it has to be let go of first
                ros_helpers.spin_some(robot.node)
            assert not robot.moves()
            command(one, STANDING)
            robot.drive_by(one)

    @pytest.mark.parametrize(('message', 'code'), [
        ('', 'malformed'), ('{', 'malformed'), ('[]', 'malformed'), ('null', 'malformed'),
        ('{"t": 1}', 'malformed'), ('{"t": 1, "v": true, "w": 0}', 'malformed'),
        ('{"t": 1, "v": "1", "w": 0}', 'malformed'), ('{"t": 1, "v": NaN, "w": 0}', 'malformed'),
        ('{"t": 1e999, "v": 0, "w": 0}', 'malformed'), ('{"t": 1, "v": 2, "w": 0}',
                                                        'out_of_range'),
        ('{"t": 1, "v": 0, "w": -1.01}', 'out_of_range'), ('[' * 60_000, 'malformed'),
        ('{"t": ' + '9' * 60_000 + ', "v": 0, "w": 0}', 'malformed'), (b'\xff\xfe', 'malformed'),
        ('{"t": 1, "v": 0, "w": 0, "x": 0}', 'malformed'), ('{"stop": 1}', 'malformed')],
        ids=range(16))
    def test_what_is_no_command_is_answered_and_moves_nothing(self, page_site, message, code):
        with page_site.socket('/drive') as drive:
            drive.send(message)
            answers = iter(lambda: json.loads(drive.recv(timeout=ros_helpers.DEADLINE)), None)
            assert next(each for each in answers if each['type'] == 'error')['code'] == code

    def test_a_huge_message_closes_the_socket(self, page_site, robot):
        with page_site.socket('/drive') as drive:
            robot.drive_by(drive)
            drive.send('x' * 1_000_000)
            wait_for_close(drive)
        robot.wait(robot.stands, 'the standstill')

    def test_a_flood_closes_the_socket(self, page_site):
        with page_site.socket('/drive') as drive:
            with suppress(ConnectionClosed):
                for _ in range(100_000):
                    command(drive, STANDING)
            wait_for_close(drive)


def seen(view, patience):
    """Return the next message and say that it was seen; None if there is none for a while."""
    try:
        message = view.recv(timeout=patience)
    except TimeoutError:
        return None
    view.n_seen = getattr(view, 'n_seen', 0) + 1
    tell(view, {'seen': view.n_seen})
    return message


def frames(message):
    return json.loads(message) if isinstance(message, str) else []


class TestViewing:
    @pytest.fixture
    def shows(self, ros_node):
        """Return what publishes where the robot is, and whether a viewer sees it then."""
        publisher = ros_node.create_publisher(Odometry, 'odom', 10)
        places = count()

        def shows(view):
            publisher.publish(odometry_from_pose(Pose(1.0, float(next(places)), 0.0, 0.0)))
            message = seen(view, 0.1)
            return message and any(frame['type'] == 'robot' for frame in frames(message))

        yield shows
        ros_node.destroy_publisher(publisher)

    def test_where_the_robot_is_arrives(self, page_site, shows):
        with page_site.socket('/view') as view:
            ros_helpers.wait_until(lambda: shows(view), processes=[page_site.process])

    def test_who_does_not_say_that_it_sees_gets_no_more_and_others_do(self, page_site, shows):
        with page_site.socket('/view') as blind, page_site.socket('/view') as view:
            for _ in range(20):
                ros_helpers.wait_until(lambda: shows(view), processes=[page_site.process])
            n_received = 0
            with suppress(TimeoutError):
                while blind.recv(timeout=0.5):
                    n_received += 1
            assert 1 <= n_received <= 4

    @pytest.mark.parametrize('message', [
        '{"seen": 99999}', '{"seen": true}', '{"seen": 1, "x": 1}', '{"seen": -1}', 'x'])
    def test_what_is_no_answer_is_told_so(self, page_site, message):
        with page_site.socket('/view') as view:
            view.send(message)
            while json.loads(view.recv(timeout=ros_helpers.DEADLINE)) != {
                    'type': 'error', 'code': 'malformed'}:
                pass


class TestGettingIn:
    @pytest.mark.parametrize('path', ['/drive', '/view'])
    @pytest.mark.parametrize('origin', ['http://evil.example', 'null', 'http://127.0.0.1:1'])
    def test_no_socket_opens_for_another_page(self, page_site, path, origin):
        with pytest.raises(InvalidStatus) as caught:
            page_site.socket(path, origin)
        assert caught.value.response.status_code == 403

    @pytest.mark.parametrize('path', ['/drive', '/view'])
    def test_no_socket_opens_without_an_origin(self, page_site, path):
        with pytest.raises(InvalidStatus):
            connect(f'ws://{page_site.host}{path}')

    def test_no_request_of_another_page_is_served(self, page_site):
        status, body, _ = page_site.get(Origin='http://evil.example')
        assert status == 403
        assert json.loads(body)['code'] == 'wrong_origin'

    def test_no_request_by_another_name_is_served(self, page_site):
        status, body, _ = page_site.get(Host='evil.example')
        assert status == 421
        assert json.loads(body)['code'] == 'wrong_host'

    def test_every_answer_says_what_a_browser_may_do_with_it(self, page_site):
        for path in ('', 'main.js', 'not-there', 'api/not-there'):
            _, _, headers = page_site.get(path)
            assert "default-src 'self'" in headers['Content-Security-Policy']
            assert 'unsafe' not in headers['Content-Security-Policy']
            assert headers['X-Content-Type-Options'] == 'nosniff'
            assert headers['Access-Control-Allow-Origin'] is None

    @pytest.mark.parametrize('path', [
        '../node.py', '%2e%2e/node.py', '..%2fnode.py', '....//node.py', '/etc/passwd',
        '%2fetc%2fpasswd', 'static/../../node.py', '%00', 'main.js%00.png', '\\..\\node.py', '.'])
    def test_no_other_file_is_read(self, page_site, path):
        with socket.create_connection(page_site.host.split(':')) as raw:
            raw.sendall(f'GET /{path} HTTP/1.1\r\nHost: {page_site.host}\r\n'
                        'Connection: close\r\n\r\n'.encode())
            answer = b''.join(iter(lambda: raw.recv(65536), b''))
        assert answer.split()[1] in (b'404', b'400', b'405')
        assert b'Traceback' not in answer

    def test_what_is_no_http_is_refused_and_nothing_else_happens(self, page_site):
        with socket.create_connection(page_site.host.split(':')) as raw:
            raw.sendall(b'\x16\x03\x01\x02\x00\x01\xff\r\n\r\n')
            assert raw.recv(65536).startswith(b'HTTP/1.1 400')
        assert page_site.get()[0] == 200
        assert page_site.process.stderr == ''

    def test_many_connections_are_let_in_and_out(self, page_site, robot):
        with page_site.socket('/drive') as drive, ExitStack() as stack:
            for _ in range(100):
                stack.enter_context(socket.create_connection(page_site.host.split(':')))
                stack.enter_context(page_site.socket('/view', open_timeout=ros_helpers.DEADLINE))
            robot.drive_by(drive)


@pytest.fixture(scope='module')
def shared(tmp_path_factory, ros_domain):
    """Return a page that anybody in the network could reach, and its token."""
    with running_site(tmp_path_factory.mktemp('shared'), ros_domain, host='0.0.0.0') as (
            process, url):
        port, _, token = url.rpartition(':')[2].partition('/?token=')
        yield Site(process, f'http://127.0.0.1:{port}/', token)


class TestToken:
    def test_it_is_made_and_nobody_gets_in_without(self, shared):
        assert len(shared.token) >= 24
        for path in ('', 'main.js', '?token=', '?token=x', f'?token={shared.token}x'):
            assert shared.get(path)[0] == 403
        for path in ('/drive', '/view', '/drive?token=x'):
            with pytest.raises(InvalidStatus):
                shared.socket(path)

    def test_it_becomes_a_cookie_and_leaves_the_address(self, shared):
        opener = build_opener(HTTPCookieProcessor())
        with opener.open(f'{shared.url}?token={shared.token}') as answer:
            assert answer.url == shared.url
            assert answer.status == 200
        with opener.open(f'{shared.url}main.js') as answer:
            assert answer.status == 200

    def test_the_cookie_is_for_this_page_only(self, shared):
        with socket.create_connection(shared.host.split(':')) as raw:
            raw.sendall(f'GET /?token={shared.token} HTTP/1.1\r\nHost: {shared.host}\r\n'
                        'Connection: close\r\n\r\n'.encode())
            head = raw.recv(65536).decode().lower()
        assert head.startswith('http/1.1 303')
        assert 'httponly' in head
        assert 'samesite=strict' in head

    def test_with_it_sockets_open(self, shared):
        with shared.socket(f'/drive?token={shared.token}') as drive:
            assert who_drives(drive) == 'nobody'


class TestStarting:
    def run(self, folder, **parameters):
        command = ros_helpers.node_command('page_node.node', folder, parameters)
        return ros_helpers.run(command, folder)

    def test_a_port_that_is_taken_is_said_in_a_line(self, page_site, tmp_path):
        port = int(page_site.host.rpartition(':')[2])
        process = self.run(tmp_path, port=port)
        assert process.popen.returncode == 2
        assert len(process.stderr.splitlines()) == 1
        assert f'port {port}' in process.stderr
        assert 'port:=0' in process.stderr

    def test_an_address_that_is_not_ours_is_said_in_a_line(self, tmp_path):
        process = self.run(tmp_path, port=0, host='192.0.2.1')
        assert process.popen.returncode == 2
        assert len(process.stderr.splitlines()) == 1
        assert '192.0.2.1' in process.stderr
