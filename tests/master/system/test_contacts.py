"""Finding contacts by their connections."""

from master.system.connections import Connection
from master.system.contacts import Contact, find_contacts


def test_contacts_are_found_by_their_connections_in_the_order_of_the_ports():
    connections = [
        Connection("line", "pantograph[2].contact.force", "rear", "contact.force"),
        Connection("line", "pantograph[2].contact.x", "rear", "contact.x"),
        Connection("line", "pantograph[1].contact.force", "front", "contact.force"),
        Connection("front", "A.x", "line", "pantograph[1].A.x"),
    ]
    assert find_contacts(connections) == (
        Contact(1, "line", "front", "line.pantograph[1].contact"),
        Contact(2, "line", "rear", "line.pantograph[2].contact"),
    )
